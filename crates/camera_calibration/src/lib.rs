//! Cameras from pictures of a printed target.
mod corner;
mod detect;
mod error;
mod target;

pub use detect::{DetectedCorner, LEAST_CORNERS, NotFound, TargetDetector};
pub use error::CameraCalibrationError;
pub use target::CharucoTarget;
