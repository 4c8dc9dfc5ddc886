//! Why the node does not start, and why the arm does not move.

use collision::CollisionError;
use devices::{ArmError, StreamFault};
use kinematics::KinematicsError;
use trajectory::TrajectoryError;

use crate::servo::StopCause;

/// Why the node does not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The ROS layer.
    #[error(transparent)]
    Ros(#[from] ros::Error),
    /// A parameter has no meaning here.
    #[error(transparent)]
    Parameter(#[from] ros::parameters::ParameterError),
    /// A description of the arm or the cell cannot be used.
    #[error("{what}: {reason}")]
    Description {
        /// Which file, or the one that is built in.
        what: String,
        /// Why not.
        reason: String,
    },
    /// A list of numbers, or limits, that cannot be.
    #[error("parameter {name}: {reason}")]
    Value {
        /// Name of the parameter.
        name: &'static str,
        /// What was found and what is allowed.
        reason: String,
    },
    /// No thread for the servo loop.
    #[error("the servo thread cannot be started: {0}")]
    Thread(#[from] std::io::Error),
}

/// Why the arm does not move, or did not move to the end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// Nobody has armed it, or it lost that.
    #[error("the arm is not ready: {reason}; `recover` makes it ready")]
    NotReady {
        /// How it is.
        reason: String,
    },
    /// It does something else.
    #[error("the arm is busy with another motion")]
    Busy,
    /// The motion does not begin where the arm is.
    #[error(
        "the motion begins elsewhere than the arm stands: joint {joint} begins at {start:.4} rad and stands at {stands:.4} rad, allowed is a difference of {tolerance} rad"
    )]
    Elsewhere {
        /// Its number, 1 for the first.
        joint: usize,
        /// Of the motion, radians.
        start: f64,
        /// Where the arm is, radians.
        stands: f64,
        /// Largest difference allowed, radians.
        tolerance: f64,
    },
    /// A motion that cannot be, or that leaves its limits.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// A pose that cannot be reached.
    #[error(transparent)]
    Kinematics(#[from] KinematicsError),
    /// Something is in the way.
    #[error(
        "collision after {time:.2} s: {link} with {with}, {distance_mm:.1} mm (less than {margin_mm:.1} mm apart counts)"
    )]
    Collision {
        /// From the motion's begin, seconds.
        time: f64,
        /// Of the arm, or what it carries.
        link: String,
        /// Another link, or an obstacle.
        with: String,
        /// Negative: how deep.
        distance_mm: f64,
        /// What counts as a collision.
        margin_mm: f64,
    },
    /// The check itself failed.
    #[error("the motion cannot be checked: {0}")]
    Unchecked(#[from] CollisionError),
    /// A cup whose pump is off will hold nothing.
    #[error("the pump is off, and the motion is to end when the cup holds something: switch it on with `vacuum/set`")]
    PumpOff,
    /// It was stopped on the way; the arm holds.
    #[error("the motion did not go to its end: {0}")]
    Stopped(StopCause),
    /// The arm takes no set-points any more.
    #[error("the motion did not go to its end: {0}")]
    Lost(StreamFault),
    /// The driver.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// A request with numbers or names that cannot be.
    #[error("{0}")]
    Request(String),
}
