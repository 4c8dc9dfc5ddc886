//! `cameras.yaml`: where cameras are.

use std::path::Path;

use geometry::RigidTransform;
use serde::{Deserialize, Serialize};

use crate::error::CalibrationFileError;
use crate::text_file;

/// The version this crate writes and reads.
const VERSION: u32 = 1;

/// The content of a file.
///
/// ```
/// use calibration_files::{CameraPose, CameraPosesFile};
/// use geometry::RigidTransform;
///
/// let c1 = CameraPose::new("c1", "link_eef", "c1_optical_frame", &RigidTransform::identity());
/// let text = CameraPosesFile::new("2026-11-29", vec![c1]).to_text()?;
/// assert!(CameraPosesFile::from_text(&text)?.camera("c1").is_some());
/// # Ok::<(), calibration_files::CalibrationFileError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPosesFile {
    version: u32,
    /// When it was made, as a person would write it.
    pub date: String,
    /// A name is there once.
    pub cameras: Vec<CameraPose>,
}

/// Where a camera is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPose {
    /// Its name, such as `c1`.
    pub camera: String,
    /// What it is fixed to; parameter `parent_frame_id` of `camera_capture`.
    pub parent_frame_id: String,
    /// Its optical frame; parameter `frame_id`.
    pub frame_id: String,
    /// x y z (metres) and unit quaternion qx qy qz qw of `parent_from_camera`; parameter `pose`.
    pose: [f64; 7],
    /// Standard deviation of the place, metres; none when it is not known.
    #[serde(default)]
    pub deviation_m: Option<f64>,
    /// Standard deviation of the direction, radians; none when it is not known.
    #[serde(default)]
    pub deviation_rad: Option<f64>,
    /// Root mean square misfit in the images, pixels; none when it is not known.
    #[serde(default)]
    pub rms_px: Option<f64>,
    /// Views it was made with; none when they were not counted.
    #[serde(default)]
    pub views: Option<usize>,
}

impl CameraPose {
    /// A pose `parent_from_camera` of which nothing more is known.
    pub fn new(
        camera: impl Into<String>,
        parent_frame_id: impl Into<String>,
        frame_id: impl Into<String>,
        parent_from_camera: &RigidTransform,
    ) -> Self {
        let [x, y, z] = parent_from_camera.translation().into();
        let [qx, qy, qz, qw] = parent_from_camera.quaternion_xyzw();
        Self {
            camera: camera.into(),
            parent_frame_id: parent_frame_id.into(),
            frame_id: frame_id.into(),
            pose: [x, y, z, qx, qy, qz, qw],
            deviation_m: None,
            deviation_rad: None,
            rms_px: None,
            views: None,
        }
    }

    /// `parent_from_camera`.
    pub fn parent_from_camera(&self) -> Result<RigidTransform, CalibrationFileError> {
        let [x, y, z, qx, qy, qz, qw] = self.pose;
        RigidTransform::from_quaternion_xyzw([x, y, z], [qx, qy, qz, qw]).map_err(|source| CalibrationFileError::Pose {
            camera: self.camera.clone(),
            source,
        })
    }

    /// x y z qx qy qz qw, as launch configs have it.
    pub fn pose(&self) -> [f64; 7] {
        self.pose
    }
}

impl CameraPosesFile {
    /// The content for these cameras.
    pub fn new(date: impl Into<String>, cameras: Vec<CameraPose>) -> Self {
        Self {
            version: VERSION,
            date: date.into(),
            cameras,
        }
    }

    /// A camera's pose, by its name.
    pub fn camera(&self, name: &str) -> Option<&CameraPose> {
        self.cameras.iter().find(|camera| camera.camera == name)
    }

    /// Reads a file; its poses are checked as well.
    pub fn read(path: &Path) -> Result<Self, CalibrationFileError> {
        Self::from_text(&text_file::read(path)?)
    }

    /// Writes a file; one that is there is replaced.
    pub fn write(&self, path: &Path) -> Result<(), CalibrationFileError> {
        text_file::write(path, &self.to_text()?)
    }

    /// From a file's text.
    pub fn from_text(text: &str) -> Result<Self, CalibrationFileError> {
        let file: Self = serde_yaml_ng::from_str(text).map_err(CalibrationFileError::CamerasFormat)?;
        if file.version != VERSION {
            return Err(CalibrationFileError::Version {
                found: file.version,
                understood: VERSION,
            });
        }
        for (index, camera) in file.cameras.iter().enumerate() {
            camera.parent_from_camera()?;
            if file.cameras[..index].iter().any(|other| other.camera == camera.camera) {
                return Err(CalibrationFileError::Twice {
                    camera: camera.camera.clone(),
                });
            }
        }
        Ok(file)
    }

    /// As a file's text.
    pub fn to_text(&self) -> Result<String, CalibrationFileError> {
        serde_yaml_ng::to_string(self).map_err(CalibrationFileError::CamerasFormat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text() -> String {
        let pose = RigidTransform::from_quaternion_xyzw([0.07, 0.01, 0.03], [0.0, 0.0, 0.6, 0.8]).unwrap();
        let mut c1 = CameraPose::new("c1", "link_eef", "c1_optical_frame", &pose);
        c1.deviation_m = Some(1e-4);
        CameraPosesFile::new("2026-11-29", vec![c1]).to_text().unwrap()
    }

    #[test]
    fn what_is_written_is_read_again() {
        let file = CameraPosesFile::from_text(&text()).unwrap();
        let c1 = file.camera("c1").unwrap();
        assert_eq!(c1.pose()[..3], [0.07, 0.01, 0.03]);
        assert_eq!((c1.parent_frame_id.as_str(), c1.deviation_m), ("link_eef", Some(1e-4)));
        assert_eq!(file.camera("c2"), None);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cameras.yaml");
        file.write(&path).unwrap();
        assert_eq!(CameraPosesFile::read(&path).unwrap(), file);
    }

    #[test]
    fn a_wrong_file_is_refused_with_its_place() {
        let said = |from: &str, to: &str| {
            CameraPosesFile::from_text(&text().replace(from, to))
                .unwrap_err()
                .to_string()
        };
        assert!(said("version: 1", "version: 7").contains("version 7 of the format"));
        assert!(said("camera: c1", "kamera: c1").contains("not a file of cameras"));
        assert!(
            said("- 0.8", "- 0.1").starts_with("camera c1: "),
            "{}",
            said("- 0.8", "- 0.1")
        );
        let doubled = text().replace(
            "cameras:\n",
            "cameras:\n- {camera: c1, parent_frame_id: a, frame_id: b, pose: [0, 0, 0, 0, 0, 0, 1]}\n",
        );
        assert!(
            CameraPosesFile::from_text(&doubled)
                .unwrap_err()
                .to_string()
                .contains("camera c1 is there twice")
        );
    }
}
