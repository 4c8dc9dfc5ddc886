//! Why the node does not start.

/// Every failure of this node, by cause. What goes wrong with the lights is no failure of the node: it is told to the
/// callers and in the state.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The ROS layer.
    #[error(transparent)]
    Ros(#[from] ros::Error),
    /// A parameter has no meaning here.
    #[error(transparent)]
    Parameter(#[from] ros::parameters::ParameterError),
}
