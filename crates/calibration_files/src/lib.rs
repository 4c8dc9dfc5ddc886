//! Calibrations as files people can read: `lights.yaml`, and `cameras.yaml` with the cameras' poses.
//!
//! Only the files: fitting is `photometric`'s and `camera_calibration`'s; lenses are in files of their own, as ROS has them. What a file says is checked when it is read; a wrong number is named with
//! its place and what is allowed.
//!
//! ```
//! use calibration_files::{LightsFile, MadeWith};
//! use photometric::LightRig;
//!
//! let made_with = vec![MadeWith { camera: "c1".into(), width: 768, height: 768 }];
//! let file = LightsFile::new(&LightRig::nominal(), "2026-11-25", made_with, Vec::new());
//! let text = file.to_text()?;
//! assert_eq!(LightsFile::from_text(&text)?.rig()?.channels(), [1, 2, 3, 4, 5, 6, 7]);
//! # Ok::<(), calibration_files::CalibrationFileError>(())
//! ```

mod error;
mod lights;
mod poses;
mod text_file;

pub use error::CalibrationFileError;
pub use lights::{LightResidual, LightsFile, MadeWith, PlacementResidual};
pub use poses::{CameraPose, CameraPosesFile};
