//! The simulated arm through its sockets, by frames alone.

mod client;
mod handshake;
mod servo;
