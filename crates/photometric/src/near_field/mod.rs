//! Normals under panels near the work.

mod bounced;
mod candidates;
mod coupling;
mod fit;
mod gain;
mod height;
mod lanes;
mod light_field;
mod pixel;
mod pixels;
mod samples;
mod solve;

pub(crate) use pixels::Pixels;
pub(crate) use solve::{FirstLook, Solved, solve};
pub use solve::{NearFieldOptions, near_field_normals};
