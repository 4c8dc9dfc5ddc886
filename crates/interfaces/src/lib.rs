//! The ROS 2 message, service and action types of the cell, generated from their interface files.
//!
//! Types come from `msgs/` (ours) and from this crate's `standard/` folder (the standard packages we use) when the
//! crate is built. Here are the types, their CDR form, and nothing else: no node, no topic, no network. That is the
//! `ros` crate; bags are the `recording` crate.
//!
//! ```
//! use interfaces::sensor_msgs::msg::Image;
//! use interfaces::{Message, cdr};
//!
//! let mut image = Image { height: 2, width: 3, encoding: "mono8".into(), step: 3, ..Image::default() };
//! image.data = vec![0, 50, 100, 150, 200, 250].into();
//! let bytes = cdr::to_vec(&image)?;
//! assert_eq!(cdr::from_slice::<Image>(&bytes)?, image);
//! assert_eq!(Image::TYPE_NAME, "sensor_msgs/msg/Image");
//! # Ok::<(), interfaces::cdr::Error>(())
//! ```
//!
//! # Where things are
//!
//! A file `P/msg/N.msg` is [`Message`] `P::msg::N`. `P/srv/N.srv` is the [`Service`] `P::srv::N` with `NRequest` and
//! `NResponse`; `P/action/N.action` is the [`Action`] `P::action::N` with `NGoal`, `NResult` and `NFeedback`. Fields
//! have the file's names (a Rust keyword gets a trailing `_`), constants are associated constants, and `Default` gives
//! the file's defaults. `uint8[]`, `byte[]` and `char[]` are [`ByteSequence`]s, whose clones share their bytes.
//! The grammar and the whole table of types stand in the `interface_generator` crate.
//!
//! To add a standard type, put its file into `standard/<package>/msg/` with the field list and defaults of its package;
//! the tests compare every standard file with the definitions that rosbags knows.

mod byte_sequence;
pub mod cdr;
mod message;
#[doc(hidden)]
pub mod support;
mod time;

pub use byte_sequence::ByteSequence;
pub use message::{Action, Message, MessageVisitor, Service, definition};
pub use time::TimeOutOfRange;

include!(concat!(env!("OUT_DIR"), "/interfaces.rs"));
