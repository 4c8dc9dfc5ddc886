//! The cell's ROS 2 layer: nodes, topics, services, actions, parameters, time, TF, diagnostics.
