//! What can go wrong between a node and the ROS graph.

use std::time::Duration;

use crate::action::{GoalEvent, GoalStatus};
use crate::names::NameError;
use crate::parameters::ParameterError;
use crate::tf::TfError;

/// Every failure of this crate, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A node, topic, service or parameter name breaks the ROS 2 naming rules.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A parameter is not as it was declared, or a parameter file or launch config is not right.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A transform is missing or was refused.
    #[error(transparent)]
    Tf(#[from] TfError),
    /// The process has a logger already.
    #[error("cannot install the logger: {reason}")]
    Logging {
        /// What the logger said.
        reason: String,
    },
    /// An environment variable or a ROS argument has a value that means nothing.
    #[error("{setting} is {found:?}; allowed: {allowed}")]
    Setting {
        /// The variable or argument.
        setting: &'static str,
        /// Its value.
        found: String,
        /// What would be accepted.
        allowed: &'static str,
    },
    /// The DDS participant could not be made.
    #[error("cannot join ROS domain {domain_id}: {reason}")]
    Participant {
        /// The ROS domain.
        domain_id: u16,
        /// What the middleware said.
        reason: String,
    },
    /// A topic, reader or writer could not be made.
    #[error("cannot create {what} {name:?}: {reason}")]
    Create {
        /// "publisher", "subscription", "service server", ...
        what: &'static str,
        /// Fully qualified name.
        name: String,
        /// What the middleware said.
        reason: String,
    },
    /// A message was not sent.
    #[error("cannot publish on {topic}: {reason}")]
    Publish {
        /// Fully qualified topic.
        topic: String,
        /// What the middleware said.
        reason: String,
    },
    /// A service request or reply was not sent.
    #[error("cannot send on service {service}: {reason}")]
    Send {
        /// Fully qualified service.
        service: String,
        /// What the middleware said.
        reason: String,
    },
    /// Nobody answered in time.
    #[error("{what} {name} did not answer within {waited:?}")]
    TimedOut {
        /// "service", "action", ...
        what: &'static str,
        /// Fully qualified name.
        name: String,
        /// How long it was waited for.
        waited: Duration,
    },
    /// Nobody offers what was asked for.
    #[error("no {what} {name} appeared within {waited:?}")]
    NotFound {
        /// "service server", "subscriber", ...
        what: &'static str,
        /// Fully qualified name.
        name: String,
        /// How long it was waited for.
        waited: Duration,
    },
    /// The node was shut down while the call was under way.
    #[error("node {node} is shut down")]
    ShutDown {
        /// Fully qualified node name.
        node: String,
    },
    /// A server declined a goal.
    #[error("the server of action {action} rejects the goal")]
    GoalRejected {
        /// Fully qualified action.
        action: String,
    },
    /// A server cannot take a goal that it was offered.
    #[error("action {action} cannot take the goal: {reason}")]
    GoalRefused {
        /// Fully qualified action.
        action: String,
        /// Why not.
        reason: String,
    },
    /// A goal is in a state in which this cannot happen to it.
    #[error("a goal of action {action} cannot {event:?} while it is {state:?}; it is aborted")]
    GoalState {
        /// Fully qualified action.
        action: String,
        /// What was to happen.
        event: GoalEvent,
        /// The state it was in.
        state: GoalStatus,
    },
    /// A goal was not asked to stop.
    #[error("the goal of action {action} is not cancelled: {reason}")]
    NotCancelled {
        /// Fully qualified action.
        action: String,
        /// Why not.
        reason: &'static str,
    },
    /// The server left the graph while a goal was under way.
    #[error("the server of action {action} is gone; its goal has no result")]
    ServerGone {
        /// Fully qualified action.
        action: String,
    },
    /// The server does not know a goal that was accepted: it was restarted, or has dropped the result.
    #[error("the server of action {action} does not know the goal (any more); was it restarted?")]
    GoalForgotten {
        /// Fully qualified action.
        action: String,
    },
}
