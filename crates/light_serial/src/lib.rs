//! The driver of the light controller on a serial port: a [`LightBank`](devices::LightBank) whose other end is the
//! firmware in `light_protocol`.
//!
//! [`LightController::open`] returns at once; a task opens the port, greets the firmware, keeps it awake while anything is
//! lit, and opens the port again whenever it is lost. Times come out as this host's: the driver fits the firmware's clock
//! to the monotonic clock from the bounds that every reply gives. A sequence that did not run exactly as asked, or of
//! which one report is missing, is an error and the lights go off.
//!
//! It knows no ROS and no camera, and it does not repeat a sequence: the cameras would see the triggers twice.
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use devices::{LightBank, LightLink, PanelSet};
//! use light_serial::{LightController, LightSerialConfig};
//!
//! # async fn example() -> Result<(), devices::LightError> {
//! let lights = LightController::open(LightSerialConfig::new("/dev/ttyACM0"));
//! let mut state = lights.state();
//! // It ends when the driver does, which is not before `lights` is dropped.
//! let _ = state.wait_for(|state| matches!(state.link, LightLink::Connected { .. })).await;
//! lights.set(PanelSet([true; 7]), Duration::from_secs(2)).await?;
//! lights.close().await;
//! # Ok(())
//! # }
//! ```

mod clock;
mod config;
mod connection;
mod controller;
mod convert;
mod error;
mod greeting;
mod job;
mod line;
mod ports;
mod sequence_run;
mod session;
mod shared;
mod statistics;

pub use config::LightSerialConfig;
pub use controller::LightController;
pub use ports::{PortInfo, list_ports};
pub use statistics::LinkStatistics;
