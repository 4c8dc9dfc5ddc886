//! The simulated arm through its sockets, by frames alone.

mod client;
mod errors;
mod handshake;
mod network;
mod queue;
mod reports;
mod servo;
mod tool;
mod velocity;
