//! The node of the arm as other nodes see it, with the real driver and the simulated controller behind its sockets. What
//! the arm did is seen at the controller.

mod faults;
mod motions;
mod picks;
mod scene;
mod stops;
