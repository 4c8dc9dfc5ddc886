//! The driver of GenICam cameras, through Aravis.
mod calibration_file;
mod camera;
mod config;
mod error;

pub use calibration_file::CalibrationFile;
pub use camera::AravisCamera;
pub use config::CameraConfig;
pub use error::CameraAravisError;
