//! The node of the arm: it executes trajectories, stops when told, and never moves on unchecked data.
