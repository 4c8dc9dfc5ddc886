//! How the arm stands with this node.

use crate::error::MotionError;

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Standing {
    /// This node does not hold it.
    Disarmed,
    /// It is held, and a motion would be begun.
    Ready,
    Moving,
    /// On the way to rest; with a reason it stays stopped there.
    Stopping {
        latched: Option<String>,
    },
    /// It is held, and motions are refused.
    Stopped {
        reason: String,
    },
    /// This node has lost it.
    Lost {
        reason: String,
    },
}

impl Standing {
    pub(crate) fn is_moving(&self) -> bool {
        matches!(self, Self::Moving | Self::Stopping { .. })
    }

    pub(crate) fn require_ready(&self) -> Result<(), MotionError> {
        let reason = match self {
            Self::Ready => return Ok(()),
            Self::Moving | Self::Stopping { .. } => return Err(MotionError::Busy),
            Self::Disarmed => "it is not armed".to_owned(),
            Self::Stopped { reason } => format!("it was stopped ({reason})"),
            Self::Lost { reason } => reason.clone(),
        };
        Err(MotionError::NotReady { reason })
    }

    /// After a request to stop and stay so.
    pub(crate) fn stopped(&self, reason: &str) -> Self {
        match self {
            Self::Moving | Self::Stopping { .. } => Self::Stopping {
                latched: Some(reason.to_owned()),
            },
            Self::Ready | Self::Stopped { .. } => Self::Stopped {
                reason: reason.to_owned(),
            },
            Self::Disarmed | Self::Lost { .. } => self.clone(),
        }
    }

    /// After a motion has come to rest; `cause` if that was not at its end.
    pub(crate) fn at_rest(&self, cause: Option<String>) -> Self {
        match (self, cause) {
            (Self::Stopping { latched: Some(reason) }, _) => Self::Stopped { reason: reason.clone() },
            (Self::Stopping { latched: None }, _) | (Self::Moving, None) => Self::Ready,
            (Self::Moving, Some(reason)) => Self::Stopped { reason },
            _ => self.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_stays_until_somebody_recovers_and_a_cancel_does_not() {
        let stopping = Standing::Moving.stopped("asked");
        assert!(stopping.is_moving());
        let rests = stopping.at_rest(Some("asked".into()));
        assert_eq!(rests, Standing::Stopped { reason: "asked".into() });
        assert!(rests.require_ready().is_err());
        let cancelled = Standing::Stopping { latched: None }.at_rest(Some("cancelled".into()));
        assert_eq!(cancelled, Standing::Ready);
    }

    #[test]
    fn what_ends_a_motion_from_inside_stays_as_well() {
        let rests = Standing::Moving.at_rest(Some("the servo loop was late".into()));
        assert!(matches!(rests, Standing::Stopped { .. }));
        assert_eq!(Standing::Moving.at_rest(None), Standing::Ready);
        assert_eq!(Standing::Disarmed.stopped("asked"), Standing::Disarmed);
    }
}
