//! The ROS 2 message, service and action types of the cell, generated from their interface files.
