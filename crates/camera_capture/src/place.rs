//! Where a camera is: by parameters, or by a calibration's file.

use std::path::Path;

use calibration_files::CameraPosesFile;
use geometry::RigidTransform;

use crate::error::Error;

/// A camera and what it is fixed to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    /// A link of the arm, or what stands.
    pub(crate) parent_frame_id: String,
    pub(crate) parent_from_camera: RigidTransform,
}

/// What the parameters say.
pub(crate) struct GivenPlace<'a> {
    pub(crate) camera: &'a str,
    pub(crate) parent_frame_id: String,
    /// Empty: not here.
    pub(crate) pose: Vec<f64>,
    /// Empty: none.
    pub(crate) file: String,
}

impl GivenPlace<'_> {
    /// The one place that is given; two are refused, for nobody knows which is meant.
    pub(crate) fn place(self) -> Result<Option<Place>, Error> {
        if self.file.is_empty() {
            return self.by_parameters();
        }
        if !self.pose.is_empty() {
            return Err(self.refuse(format!("{}.pose_file is given as well", self.camera)));
        }
        let in_file = |problem: String| Error::PoseFile {
            camera: self.camera.to_owned(),
            file: self.file.clone(),
            problem,
        };
        let file = CameraPosesFile::read(Path::new(&self.file)).map_err(|error| in_file(error.to_string()))?;
        let known = file.cameras.iter().map(|camera| camera.camera.as_str());
        let found = file
            .camera(self.camera)
            .ok_or_else(|| in_file(format!("it has only: {}", known.collect::<Vec<_>>().join(", "))))?;
        let pose = found.parent_from_camera().map_err(|error| in_file(error.to_string()))?;
        Ok(Some(Place {
            parent_frame_id: found.parent_frame_id.clone(),
            parent_from_camera: pose,
        }))
    }

    fn by_parameters(self) -> Result<Option<Place>, Error> {
        let pose = match *self.pose.as_slice() {
            [] => return Ok(None),
            [x, y, z, qx, qy, qz, qw] => RigidTransform::from_quaternion_xyzw([x, y, z], [qx, qy, qz, qw]),
            _ => return Err(self.refuse(format!("{} numbers", self.pose.len()))),
        };
        match pose {
            Ok(parent_from_camera) => Ok(Some(Place {
                parent_frame_id: self.parent_frame_id,
                parent_from_camera,
            })),
            Err(problem) => Err(self.refuse(problem.to_string())),
        }
    }

    fn refuse(&self, problem: String) -> Error {
        Error::Pose {
            camera: self.camera.to_owned(),
            found: self.pose.clone(),
            problem,
        }
    }
}

#[cfg(test)]
mod tests {
    use calibration_files::CameraPose;

    use super::*;

    const POSE: [f64; 7] = [0.07, 0.01, 0.03, 0.0, 0.0, 0.6, 0.8];

    fn given<'a>(camera: &'a str, pose: &[f64], file: &str) -> GivenPlace<'a> {
        GivenPlace {
            camera,
            parent_frame_id: "link_base".into(),
            pose: pose.to_vec(),
            file: file.into(),
        }
    }

    #[test]
    fn a_file_says_what_the_camera_is_fixed_to() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cameras.yaml");
        let [x, y, z, qx, qy, qz, qw] = POSE;
        let pose = RigidTransform::from_quaternion_xyzw([x, y, z], [qx, qy, qz, qw]).unwrap();
        let c1 = CameraPose::new("c1", "link_eef", "c1_optical_frame", &pose);
        CameraPosesFile::new("today", vec![c1]).write(&path).unwrap();
        let file = path.to_str().unwrap();
        let place = given("c1", &[], file).place().unwrap().unwrap();
        assert_eq!(place.parent_frame_id, "link_eef");
        assert!((place.parent_from_camera.translation().x - 0.07).abs() < 1e-12);

        let both = given("c1", &POSE, file).place().unwrap_err().to_string();
        assert!(both.contains("c1.pose_file is given as well"), "{both}");
        let other = given("c2", &[], file).place().unwrap_err().to_string();
        assert!(other.contains("it has only: c1"), "{other}");
        let missing = given("c1", &[], "nowhere.yaml").place().unwrap_err().to_string();
        assert!(missing.contains("nowhere.yaml"), "{missing}");
    }

    #[test]
    fn parameters_say_it_as_before() {
        assert_eq!(given("c1", &[], "").place().unwrap(), None);
        assert_eq!(
            given("c1", &POSE, "").place().unwrap().unwrap().parent_frame_id,
            "link_base"
        );
        let short = given("c1", &POSE[..3], "").place().unwrap_err().to_string();
        assert!(short.contains("3 numbers"), "{short}");
    }
}
