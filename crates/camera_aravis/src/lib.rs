//! The driver of GigE Vision cameras, through Aravis: [`AravisCamera`] is a [`devices::Camera`].
//!
//! It opens the camera by address or serial number, sets it up feature by feature with every range checked, receives
//! its frames without copying them, tells stale frames from awaited ones by the camera's own clock, and opens the
//! camera again after a loss. [`CalibrationFile`] reads and writes the file of ROS's `camera_calibration`;
//! [`list_cameras`] and [`probe`] look for cameras.
//!
//! It is not a ROS node, it takes no decision about captures (a frame that never comes is the caller's to miss), and it
//! does no image processing.
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use camera_aravis::{AravisCamera, CameraConfig};
//! use devices::{Binning, Camera, CameraLink, CameraSettings, FrameEvent, TriggerMode};
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let camera = AravisCamera::open(CameraConfig::new("127.0.0.2"));
//! camera.link().wait_for(|link| matches!(link, CameraLink::Open { .. })).await?;
//! let settings = CameraSettings {
//!     region: None,
//!     binning: Binning { horizontal: 1, vertical: 1 },
//!     exposure: Duration::from_micros(2500),
//!     gain_db: 0.0,
//!     black_level: 0.0,
//!     trigger: TriggerMode::Software,
//! };
//! println!("{:?}", camera.configure(settings).await?);
//! let mut frames = camera.arm(1).await?;
//! camera.trigger().await?;
//! match frames.recv().await {
//!     Some(FrameEvent::Frame(frame)) => println!("{} bytes", frame.pixels.len()),
//!     Some(FrameEvent::Fault(fault)) => println!("no image: {fault}"),
//!     None => println!("the camera is lost"),
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Without the feature `aravis` (on by default) everything is here but the cameras: [`AravisCamera`] is always lost,
//! and says why.

#[cfg(feature = "aravis")]
mod armed;
mod calibration_file;
mod camera;
mod config;
mod discovery;
#[cfg(feature = "aravis")]
mod driver;
mod error;
#[cfg(feature = "aravis")]
mod frame_order;

pub use calibration_file::CalibrationFile;
pub use camera::AravisCamera;
pub use config::CameraConfig;
pub use discovery::{CameraSighting, list_cameras, probe};
pub use error::CameraAravisError;
