//! The coordinator as its users see it: the real node, and stand-ins for the nodes it calls where the fault is theirs.

mod cell;
mod guard;
mod kills;
mod picks;
mod stages;
