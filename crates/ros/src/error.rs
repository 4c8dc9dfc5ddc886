//! What can go wrong between a node and the ROS graph.

use std::time::Duration;

use crate::names::NameError;

/// Every failure of this crate, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A node, topic, service or parameter name breaks the ROS 2 naming rules.
    #[error(transparent)]
    Name(#[from] NameError),
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
}
