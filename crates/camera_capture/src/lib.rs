//! The node of the cameras: takes captures.
