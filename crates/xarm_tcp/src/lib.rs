//! The driver of the xArm7 over TCP: an [`Arm`](devices::Arm) and a [`Suction`](devices::Suction) whose other end is the
//! maker's controller.
//!
//! [`XArm::open`] returns at once; a task connects to the controller, follows its reports, and connects again whenever it
//! is lost. That task alone decides on the controller's mode, and it notices when another client does. Set-points go from
//! the caller's thread straight into a TCP connection of their own.
//!
//! It is *not* a safety function and plans no motion: limits of speed, acceleration and workspace belong to whoever makes
//! the set-points, and the emergency stop to the control box. The crate's `README.md` tells how the arm is wired, what its
//! error numbers mean, and how to get out of a fault.
//!
//! ```no_run
//! use devices::{Arm, ArmLink};
//! use xarm_tcp::{XArm, XArmConfig};
//!
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! let arm = XArm::open(XArmConfig::new("192.168.1.217"));
//! let mut state = arm.state();
//! let connected = state.wait_for(|state| matches!(state.link, ArmLink::Connected { .. })).await?;
//! let here = connected.joints.expect("a connected arm has reported").angles;
//! drop(connected);
//! let mut stream = arm.arm().await?;
//! // Every 4 ms, from a real-time thread.
//! stream.send(&here)?;
//! arm.stop().await?;
//! arm.close().await;
//! # Ok(())
//! # }
//! ```

mod arm;
mod calibration;
mod config;
mod connection;
mod control;
mod error;
mod faults;
mod greeting;
mod job;
mod motion;
mod observed;
mod reports;
mod session;
mod shared;
mod statistics;
mod stream;
mod stream_end;
mod suction;
mod units;
mod velocity;

pub use arm::XArm;
pub use config::{Timeouts, XArmConfig};
pub use statistics::ArmStatistics;
pub use xarm_protocol::VacuumHardware;
