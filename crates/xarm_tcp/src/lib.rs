//! The driver of the xArm7 over TCP.
