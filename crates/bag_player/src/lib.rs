//! The node that publishes a recorded bag as if it were live.
