//! Why a calibration file cannot be used.

use std::path::PathBuf;

use geometry::GeometryError;
use photometric::PhotometricError;

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationFileError {
    /// It cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is not what a file of lights looks like: a key is missing, unknown or of another kind.
    #[error("not a file of lights: {0}")]
    Format(#[from] serde_yaml_ng::Error),
    /// It is not what a file of cameras looks like: a key is missing, unknown or of another kind.
    #[error("not a file of cameras: {0}")]
    CamerasFormat(#[source] serde_yaml_ng::Error),
    /// A pose is none.
    #[error("camera {camera}: {source}")]
    Pose {
        /// The camera.
        camera: String,
        /// Why.
        source: GeometryError,
    },
    /// A camera has two poses.
    #[error("camera {camera} is there twice")]
    Twice {
        /// The camera.
        camera: String,
    },
    /// It was written by another version.
    #[error("version {found} of the format, understood is {understood}")]
    Version {
        /// In the file.
        found: u32,
        /// The one this crate reads.
        understood: u32,
    },
    /// A direction has no length, or two that should be at right angles are not.
    #[error("light {channel}: {what} = {value:?}, expected are {allowed}")]
    Direction {
        /// The light.
        channel: u8,
        /// Which vector.
        what: &'static str,
        /// In the file.
        value: [f64; 3],
        /// In words.
        allowed: &'static str,
    },
    /// The lights cannot be a rig.
    #[error("{0}")]
    Rig(#[from] PhotometricError),
    /// The images to solve are another camera's.
    #[error("made with {made_with}, not with camera {camera} at {width} x {height}")]
    OtherCamera {
        /// What the file names.
        made_with: String,
        /// The camera to solve.
        camera: String,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
    },
}
