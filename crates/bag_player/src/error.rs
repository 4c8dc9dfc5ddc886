//! Why a bag is not played.

use std::time::Duration;

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
    /// The bag cannot be read.
    #[error(transparent)]
    Recording(#[from] recording::RecordingError),
    /// No bag was named.
    #[error("parameter bag is empty; allowed: the path of a bag folder or of an .mcap file")]
    NoBag,
    /// Nothing in the bag can be published.
    #[error("nothing in {bag} can be published: {reason}")]
    NothingToPlay {
        /// The bag.
        bag: String,
        /// Why its topics cannot.
        reason: String,
    },
    /// Nobody listens.
    #[error("nobody subscribed to {topic} within {waited:?}; the bag was not played")]
    NobodyListens {
        /// A topic without subscription.
        topic: String,
        /// How long it was waited for.
        waited: Duration,
    },
    /// A recorded message is not what its type says.
    #[error(transparent)]
    Cdr(#[from] interfaces::cdr::Error),
    /// A pixel's size is not known, so pixels cannot be repeated.
    #[error("images encoded as {found:?} cannot be enlarged; allowed: mono8, mono16, rgb8, bgr8, 32FC1, 32FC3")]
    Encoding {
        /// What the image says.
        found: String,
    },
    /// An image has less data than its size needs.
    #[error("an image of {width} x {height} has {found} bytes; it needs {needed}")]
    ImageSize {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Bytes of data.
        found: usize,
        /// Bytes that the size and the row step call for.
        needed: usize,
    },
    /// A camera's intrinsics make no camera.
    #[error(transparent)]
    Camera(#[from] geometry::GeometryError),
}
