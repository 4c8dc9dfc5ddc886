//! Turns ROS 2 interface files into Rust types.
