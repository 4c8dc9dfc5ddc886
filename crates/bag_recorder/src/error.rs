//! Why there is no recording.

use std::path::PathBuf;

use recording::RecordingError;

/// Every failure of this node, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The ROS layer.
    #[error(transparent)]
    Ros(#[from] ros::Error),
    /// A parameter has no meaning here.
    #[error(transparent)]
    Parameter(#[from] ros::parameters::ParameterError),
    /// The bag cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// One bag at a time.
    #[error("already recording {}; record/stop ends it", path.display())]
    AlreadyRecording {
        /// The bag.
        path: PathBuf,
    },
    /// There is nothing to stop.
    #[error("not recording; record/start begins a bag")]
    NotRecording,
    /// Nobody publishes the topic, and it is none of the cell's.
    #[error("topic {topic} is not known: nobody publishes it; topics of the cell that can be added: {known}")]
    UnknownTopic {
        /// Fully qualified name.
        topic: String,
        /// The cell's further topics.
        known: String,
    },
    /// The topic is there but cannot be recorded.
    #[error("topic {topic} is a {type_name}, which is not a type of the cell; allowed: {known}")]
    UnknownType {
        /// Fully qualified name.
        topic: String,
        /// Its type.
        type_name: String,
        /// The types that can be recorded.
        known: String,
    },
    /// A bag that would be over before it begins.
    #[error("max_duration is {found_s} s; allowed: more than 0, or 0 for no limit")]
    MaxDuration {
        /// As asked for, seconds.
        found_s: f64,
    },
    /// The folder for bags cannot be made.
    #[error("{}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}
