//! What the controller does with commands, and how it is.

use crate::error::ProtocolError;

/// What the controller does with commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mode {
    /// 0: it plans the motions of a queue.
    Position,
    /// 1: it follows the last target at once.
    Servo,
    /// 2: the arm is led by hand.
    FreeDrive,
    /// 4: joint velocities.
    JointVelocity,
    /// 5: velocities of the tool.
    CartesianVelocity,
    /// 6: it plans to the last joint target.
    JointOnline,
    /// 7: it plans to the last pose.
    CartesianOnline,
}

impl Mode {
    /// As on the wire.
    pub fn number(self) -> u8 {
        match self {
            Self::Position => 0,
            Self::Servo => 1,
            Self::FreeDrive => 2,
            Self::JointVelocity => 4,
            Self::CartesianVelocity => 5,
            Self::JointOnline => 6,
            Self::CartesianOnline => 7,
        }
    }
}

impl TryFrom<u8> for Mode {
    type Error = ProtocolError;

    fn try_from(number: u8) -> Result<Self, ProtocolError> {
        Ok(match number {
            0 => Self::Position,
            1 => Self::Servo,
            2 => Self::FreeDrive,
            4 => Self::JointVelocity,
            5 => Self::CartesianVelocity,
            6 => Self::JointOnline,
            7 => Self::CartesianOnline,
            other => {
                return Err(ProtocolError::Value {
                    what: "mode",
                    found: other.into(),
                    allowed: "0, 1, 2, 4, 5, 6, 7",
                });
            }
        })
    }
}

/// How the controller is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// 1: the arm moves.
    Moving,
    /// 2: it would move if told so.
    Ready,
    /// 3: between commands.
    Paused,
    /// 4: by command or by an error.
    Stopped,
    /// 5: mode or configuration was changed; it wants to be set ready.
    Changed,
    /// 6: on the way to a stop.
    Decelerating,
}

impl State {
    /// As on the wire.
    pub fn number(self) -> u8 {
        match self {
            Self::Moving => 1,
            Self::Ready => 2,
            Self::Paused => 3,
            Self::Stopped => 4,
            Self::Changed => 5,
            Self::Decelerating => 6,
        }
    }

    /// Whether a move command would be obeyed.
    pub fn takes_commands(self) -> bool {
        matches!(self, Self::Moving | Self::Ready | Self::Paused)
    }
}

impl TryFrom<u8> for State {
    type Error = ProtocolError;

    fn try_from(number: u8) -> Result<Self, ProtocolError> {
        Ok(match number {
            1 => Self::Moving,
            2 => Self::Ready,
            3 => Self::Paused,
            4 => Self::Stopped,
            5 => Self::Changed,
            6 => Self::Decelerating,
            other => {
                return Err(ProtocolError::Value {
                    what: "state",
                    found: other.into(),
                    allowed: "1 to 6",
                });
            }
        })
    }
}

/// What the state can be set to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StateCommand {
    /// 0: ready, or on with what was paused.
    Run,
    /// 3: hold between commands.
    Pause,
    /// 4: stop at once and forget what is queued.
    Stop,
    /// 6: decelerate, then stop.
    Decelerate,
}

impl StateCommand {
    /// As on the wire.
    pub fn number(self) -> u8 {
        match self {
            Self::Run => 0,
            Self::Pause => 3,
            Self::Stop => 4,
            Self::Decelerate => 6,
        }
    }
}

impl TryFrom<u8> for StateCommand {
    type Error = ProtocolError;

    fn try_from(number: u8) -> Result<Self, ProtocolError> {
        Ok(match number {
            0 => Self::Run,
            3 => Self::Pause,
            4 => Self::Stop,
            6 => Self::Decelerate,
            other => {
                return Err(ProtocolError::Value {
                    what: "state to set",
                    found: other.into(),
                    allowed: "0, 3, 4, 6",
                });
            }
        })
    }
}
