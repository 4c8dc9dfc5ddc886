//! The arm.

use std::time::{Duration, Instant};

use futures::future::BoxFuture;
use tokio::sync::watch;

/// Joints of the cell's arm.
pub const ARM_JOINTS: usize = 7;

/// Angles (rad), speeds (rad/s) or torques (Nm) of all joints, from the base on.
pub type JointValues = [f64; ARM_JOINTS];

/// An arm that follows set-points. One driver decides on its mode; nobody else changes it.
///
/// Dropping it ends the stream and closes the connections; the controller then holds the arm where it is.
pub trait Arm: Send + Sync {
    /// How the arm is; every report of the controller wakes the receiver.
    fn state(&self) -> watch::Receiver<ArmState>;

    /// Switches the servos on and makes the arm follow set-points from where it stands; hands over the stream. An older
    /// stream ends. Clears no fault: an arm that has one is refused.
    fn arm(&self) -> BoxFuture<'_, Result<Box<dyn SetPointStream>, ArmError>>;

    /// Ends the stream, and lets the controller decelerate and hold; done when the arm is reported to stand. Comes before
    /// everything else that was asked for, and ends it. Works in every state, as far as the arm can be reached.
    fn stop(&self) -> BoxFuture<'_, Result<(), ArmError>>;

    /// Clears a fault, if that is allowed, and switches the servos on again; the arm holds where it stands and follows
    /// nothing until it is armed. `looked` says that a person has looked at an arm that touched something
    /// ([`FaultRecovery::AfterLook`]).
    ///
    /// # Errors
    /// [`ArmError::Refused`] when nobody has looked, or when it would not help; [`ArmError::Fault`] when the fault is
    /// there still, as with an emergency stop that is pressed.
    fn recover(&self, looked: bool) -> BoxFuture<'_, Result<(), ArmError>>;
}

/// Where the set-points go. It is used from a real-time thread: it allocates nothing and never waits.
pub trait SetPointStream: Send {
    /// Sends the next set-point (rad), every 4 ms, for the controller to go to at once. They are close to each other, the
    /// first to where the arm stands; a driver refuses jumps. What the controller thinks of them comes back later, with
    /// another call.
    fn send(&mut self, angles: &JointValues) -> Result<(), StreamFault>;
}

/// Why a stream of set-points ended. It does not go on; the arm is armed anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StreamFault {
    /// The connection was closed or takes nothing any more, or nothing is reported of the arm any more.
    #[error("the connection to the arm is lost")]
    Disconnected,
    /// The controller has an error.
    #[error("the controller has an error and takes no set-points")]
    ControllerError,
    /// The controller would not move: it was stopped, or its mode was changed by another client.
    #[error("the controller takes no set-points: it was stopped, or another client changed its mode")]
    NotReady,
    /// The set-point has angles that are no numbers, or far from those before; or the controller refused it: it cannot do
    /// it, or another client has just changed its mode.
    #[error("a set-point was refused")]
    Refused,
    /// Set-points are sent, but none is answered.
    #[error("the controller has answered none of the last set-points")]
    Silent,
}

/// How the arm is.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmState {
    /// Whether the controller answers.
    pub link: ArmLink,
    /// What it does, and why it does not.
    pub condition: ArmCondition,
    /// The last that was measured; none before the first report.
    pub joints: Option<JointReading>,
}

/// Whether the controller answers.
#[derive(Debug, Clone, PartialEq)]
pub enum ArmLink {
    /// It does not, or its reports do not come. The driver keeps trying.
    Disconnected {
        /// For people.
        reason: String,
    },
    /// It does.
    Connected {
        /// Where it is.
        address: String,
        /// "v2.5.5".
        firmware_version: String,
        /// Of the arm.
        serial_number: String,
    },
}

/// What the arm does.
#[derive(Debug, Clone, PartialEq)]
pub enum ArmCondition {
    /// Nothing is known of it.
    Unknown,
    /// The servos are off, the controller waits to be made ready, or there is no stream that it follows; no fault.
    Disarmed,
    /// It follows the set-points of the stream that was handed over.
    Armed,
    /// It is moving.
    Moving,
    /// It was stopped.
    Stopped,
    /// The controller has an error.
    Fault(ArmFault),
}

/// An error of the controller, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArmFault {
    /// The controller's number.
    pub code: u8,
    /// What happened, with the likely cause and the remedy.
    pub description: String,
    /// How the arm gets out of it.
    pub recovery: FaultRecovery,
}

/// How an arm gets out of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultRecovery {
    /// By [`Arm::recover`].
    Automatic,
    /// By [`Arm::recover`] after a person has looked: the arm may stand against something.
    AfterLook,
    /// A person has to do something first.
    Person,
    /// Not without the maker's help, or switching it off and on.
    Service,
}

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointReading {
    /// Radians.
    pub angles: JointValues,
    /// rad/s; from successive angles where the controller does not tell, 0 at the first report.
    pub velocities: JointValues,
    /// Nm, as the controller estimates them; NaN where it reports something else.
    pub torques: JointValues,
    /// When the report came in.
    pub received_at: Instant,
}

/// Why the arm did not do what was asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// No controller.
    #[error("the arm's controller does not answer: {reason}")]
    Disconnected {
        /// What was tried and what came of it.
        reason: String,
    },
    /// The controller has an error.
    #[error("the arm has fault {}: {}", .0.code, .0.description)]
    Fault(ArmFault),
    /// What was asked for is out of a range, or the controller refused it.
    #[error("{reason}")]
    Refused {
        /// What, where, the value found and the values allowed.
        reason: String,
    },
    /// It did not happen in time.
    #[error("{what} did not happen within {timeout:?}")]
    Timeout {
        /// What was waited for.
        what: &'static str,
        /// For how long.
        timeout: Duration,
    },
}

/// A vacuum cup.
pub trait Suction: Send + Sync {
    /// Pump on, or off with the vent open. Done when the controller has said that its outputs are so.
    fn set(&self, on: bool) -> BoxFuture<'_, Result<(), ArmError>>;

    /// Whether the pump runs and something is held, asked of the controller now.
    fn read(&self) -> BoxFuture<'_, Result<SuctionState, ArmError>>;
}

/// What a cup does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SuctionState {
    /// The pump runs.
    pub on: bool,
    /// Something is held, by the cup's own detection.
    pub held: bool,
}
