//! Captures over real wires: the service's promises, and what it does when something fails on the way.

mod assistants;
mod faults;
mod images;
mod rig;
mod settings;
mod whole;
