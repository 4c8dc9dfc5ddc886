//! The node that writes bags.
