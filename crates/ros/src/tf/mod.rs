//! Transforms between frames over time: who is where relative to whom, and since when.
//!
//! A [`Buffer`] holds a tree of frames. [`Listener`] fills it from `/tf` and `/tf_static`; [`Broadcaster`] and
//! [`StaticBroadcaster`] publish there. A lookup answers `target_from_source`, or says what is missing: it never
//! invents a transform.
//!
//! ```
//! use geometry::RigidTransform;
//! use ros::tf::{Buffer, StampedTransform};
//!
//! let buffer = Buffer::default();
//! let base_from_flange = RigidTransform::from_quaternion_xyzw([0.3, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0])?;
//! buffer.insert(&StampedTransform::new("link_base", "link_eef", 1_000, base_from_flange))?;
//! let found = buffer.lookup("link_base", "link_eef", 1_000)?;
//! assert_eq!(found.translation().z, 0.5);
//! println!("{}", buffer.lookup("link_base", "c1_optical_frame", 1_000).unwrap_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod broadcaster;
mod buffer;
mod error;
mod history;
mod listener;
mod message;
#[cfg(test)]
mod tests;
mod tree;

pub use broadcaster::{Broadcaster, StaticBroadcaster};
pub use buffer::Buffer;
pub use error::TfError;
pub use listener::Listener;
pub use message::StampedTransform;
