//! Why there is no simulated arm.

use std::io;

/// Every failure of the simulated arm's start, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// A place on the network that cannot be had.
    #[error("cannot serve the arm's {role} at {place}: {reason}")]
    Bind {
        /// What it is for.
        role: &'static str,
        /// Address and port, or a path.
        place: String,
        /// The system's reason.
        reason: io::Error,
    },
    /// The arm has other than seven joints.
    #[error("the arm's identity tells of {axes} joints; allowed are 7")]
    Axes {
        /// As given.
        axes: u8,
    },
    /// An impossible calibration, or joint angles that the arm cannot have.
    #[error(transparent)]
    Kinematics(#[from] kinematics::KinematicsError),
    /// The nominal arm.
    #[error("the arm's URDF cannot be read: {reason}")]
    Urdf {
        /// What is wrong with it.
        reason: String,
    },
    /// Firmware that nobody has tried.
    #[error(transparent)]
    Protocol(#[from] xarm_protocol::ProtocolError),
}
