//! Why the node does not start.

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
    /// A parameter whose values do not fit together.
    #[error("parameter {name}: {reason}")]
    Value {
        /// Of the parameter.
        name: &'static str,
        /// What was found and what is allowed.
        reason: String,
    },
}
