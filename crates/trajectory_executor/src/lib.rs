//! The node of the arm: it executes trajectories, stops when told, and never moves on unchecked data.
//!
//! `home` and the actions `move_tool` and `follow_joint_trajectory` move the arm; `stop` decelerates it from the next
//! period on and keeps it stopped until `recover`, which brings it from any fault back to ready or says what a person has
//! to do. `joint_states` comes 100 times a second, `arm/state` on every change, frames on TF.
//!
//! Nothing moves unless the arm is armed, its state is fresh, and the whole trajectory was checked: that it begins where
//! the arm stands, keeps the limits of the joints and of the tool's speed, and touches nothing. Set-points leave from a
//! thread of their own ([`servo`]).
//!
//! It is *not* the driver (`xarm_tcp`), and it is no safety function: the emergency stop and the controller's own limits
//! are.

mod convert;
mod diagnostics;
mod error;
mod executor;
mod follow;
mod model;
mod move_tool;
mod parameters;
mod publish;
mod services;
pub mod servo;

pub use error::{Error, MotionError};

use std::sync::Arc;
use std::time::Duration;

use ros::Node;
use tokio::task::JoinSet;
use tracing::Instrument;
use xarm_tcp::XArm;

use executor::Executor;
use follow::Follow;
use model::Model;
use move_tool::MoveTool;
use parameters::Parameters;
use publish::Publishers;
use services::{Desk, Services};
use servo::{Servo, ServoConfig};

/// Name of the node in launch configs.
pub const NAME: &str = "trajectory_executor";

/// How long an arm that is armed at the start may take to answer.
const FIRST_CONTACT: Duration = Duration::from_secs(30);
