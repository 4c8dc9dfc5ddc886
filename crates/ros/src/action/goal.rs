//! A goal's identity and the states it goes through.

use std::fmt;

use interfaces::action_msgs::msg::GoalStatus as StatusMessage;
use interfaces::unique_identifier_msgs::msg::UUID;

/// Identifies a goal; drawn by the client.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct GoalId([u8; 16]);

impl GoalId {
    /// No goal: in a cancel request it stands for "every goal".
    pub(super) const ZERO: Self = Self([0; 16]);

    pub(super) fn random() -> Self {
        Self(uuid::Uuid::new_v4().into_bytes())
    }

    pub(super) fn message(self) -> UUID {
        UUID { uuid: self.0 }
    }
}

impl From<&UUID> for GoalId {
    fn from(id: &UUID) -> Self {
        Self(id.uuid)
    }
}

impl fmt::Display for GoalId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", uuid::Uuid::from_bytes(self.0))
    }
}

impl fmt::Debug for GoalId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Where a goal is, as `action_msgs/msg/GoalStatus` counts it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i8)]
pub enum GoalStatus {
    /// Never heard of, or forgotten.
    Unknown = StatusMessage::STATUS_UNKNOWN,
    /// Accepted and waiting.
    Accepted = StatusMessage::STATUS_ACCEPTED,
    /// Under way.
    Executing = StatusMessage::STATUS_EXECUTING,
    /// Under way, and asked to stop.
    Canceling = StatusMessage::STATUS_CANCELING,
    /// Ended as wanted.
    Succeeded = StatusMessage::STATUS_SUCCEEDED,
    /// Ended because it was asked to.
    Canceled = StatusMessage::STATUS_CANCELED,
    /// Ended by the server without success.
    Aborted = StatusMessage::STATUS_ABORTED,
}

/// What can happen to a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GoalEvent {
    /// The server begins.
    Execute,
    /// A client asks to stop.
    RequestCancel,
    /// The server has done it.
    Succeed,
    /// The server gives up.
    Abort,
    /// The server has stopped because it was asked to.
    Cancel,
}

impl GoalStatus {
    const ALL: [Self; 7] = [
        Self::Unknown,
        Self::Accepted,
        Self::Executing,
        Self::Canceling,
        Self::Succeeded,
        Self::Canceled,
        Self::Aborted,
    ];

    /// The state after `event`; `None` where the event is not allowed.
    ///
    /// A repeated request to cancel changes nothing and is allowed, so that a client may ask again when an answer was
    /// lost.
    pub fn after(self, event: GoalEvent) -> Option<Self> {
        match (self, event) {
            (Self::Accepted, GoalEvent::Execute) => Some(Self::Executing),
            (Self::Accepted | Self::Executing | Self::Canceling, GoalEvent::RequestCancel) => Some(Self::Canceling),
            (Self::Executing | Self::Canceling, GoalEvent::Succeed) => Some(Self::Succeeded),
            (Self::Executing | Self::Canceling, GoalEvent::Abort) => Some(Self::Aborted),
            (Self::Canceling, GoalEvent::Cancel) => Some(Self::Canceled),
            _ => None,
        }
    }

    /// Whether nothing more can happen.
    pub fn is_ended(self) -> bool {
        matches!(self, Self::Succeeded | Self::Canceled | Self::Aborted)
    }

    pub(super) fn code(self) -> i8 {
        self as i8
    }

    /// A code that ROS 2 does not define counts as unknown.
    pub(super) fn from_code(code: i8) -> Self {
        Self::ALL
            .into_iter()
            .find(|status| status.code() == code)
            .unwrap_or(Self::Unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use GoalEvent::{Abort, Cancel, Execute, RequestCancel, Succeed};
    use GoalStatus::{Aborted, Accepted, Canceled, Canceling, Executing, Succeeded};

    #[test]
    fn the_state_machine_is_that_of_ros_2() {
        let allowed = [
            (Accepted, Execute, Executing),
            (Accepted, RequestCancel, Canceling),
            (Executing, RequestCancel, Canceling),
            (Executing, Succeed, Succeeded),
            (Executing, Abort, Aborted),
            (Canceling, RequestCancel, Canceling),
            (Canceling, Cancel, Canceled),
            (Canceling, Succeed, Succeeded),
            (Canceling, Abort, Aborted),
        ];
        for from in GoalStatus::ALL {
            for event in [Execute, RequestCancel, Succeed, Abort, Cancel] {
                let expected = allowed
                    .iter()
                    .find(|(s, e, _)| (*s, *e) == (from, event))
                    .map(|(.., to)| *to);
                assert_eq!(from.after(event), expected, "{from:?} {event:?}");
            }
        }
    }

    #[test]
    fn what_has_ended_stays_so() {
        for ended in GoalStatus::ALL.into_iter().filter(|status| status.is_ended()) {
            assert!(
                [Execute, RequestCancel, Succeed, Abort, Cancel]
                    .into_iter()
                    .all(|e| ended.after(e).is_none())
            );
        }
    }

    #[test]
    fn codes_are_read_back_and_strange_ones_are_unknown() {
        for status in GoalStatus::ALL {
            assert_eq!(GoalStatus::from_code(status.code()), status);
        }
        assert_eq!(GoalStatus::from_code(7), GoalStatus::Unknown);
        assert_eq!(GoalStatus::from_code(-1), GoalStatus::Unknown);
    }

    #[test]
    fn random_ids_differ_and_are_never_zero() {
        let (first, second) = (GoalId::random(), GoalId::random());
        assert_ne!(first, second);
        assert_ne!(first, GoalId::ZERO);
        assert_eq!(GoalId::from(&first.message()), first);
    }
}
