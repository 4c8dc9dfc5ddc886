//! The driver against the real firmware: a simulated board behind a terminal, faults included. What the lights did is
//! seen on the board's pins.

mod captures;
mod faults;
mod links;
mod manual;
mod rig;
