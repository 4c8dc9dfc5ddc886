//! Just enough mechanics for objects that a cup picks up and drops: rigid bodies, what a vertical fall ends on, which
//! face a body comes to rest on. Nothing slides, bounces or pushes another thing aside.

mod fall;
mod rest;
mod solid;

pub(crate) use fall::{Placed, gap_below, way_down};
pub(crate) use rest::at_rest;
pub(crate) use solid::Solid;
