//! The driver against a simulated controller over real sockets, faults included. Where the arm is and what it was told is
//! seen at the controller.

mod faults;
mod links;
mod motions;
mod network;
mod ownership;
mod rig;
mod tool;
