//! The node of the lights.
