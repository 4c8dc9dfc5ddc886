//! MCAP bags of the cell: reading what others wrote and writing what others read.
//!
//! A bag is a folder with `metadata.yaml` and one or more `.mcap` files (rosbag2's layout), or a single `.mcap` file.
//! Messages stay serialised: this crate knows topics, type names and CDR bytes, not message types.
//!
//! [`Bag::open`] reads every record once and keeps an index, so that messages come in the order of their log times
//! whatever their order in the file, and so that a bag cut off at any byte gives everything before the cut. What could
//! not be read is named in [`BagReport`]. [`BagWriter`] writes chunks compressed with zstd and protected by CRCs, and
//! [`BackgroundWriter`] does so on a thread of its own, for those who must not wait for a disk.
//!
//! ```
//! use recording::{Bag, BagWriter, OfferedQos};
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("note");
//! let mut writer = BagWriter::create(&path)?;
//! let note = writer.add_topic("/note", "std_msgs/msg/String", "string data\n", &OfferedQos::default().into())?;
//! writer.write(note, 1_700_000_000_000_000_000, b"\x00\x01\x00\x00\x03\x00\x00\x00hi\x00")?;
//! writer.finish()?;
//!
//! let bag = Bag::open(&path)?;
//! assert!(bag.report().is_whole());
//! for message in bag.messages() {
//!     let message = message?;
//!     println!("{} {} {} bytes", message.log_time, message.topic.name, message.cdr.len());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod background;
mod bag;
mod chunk;
mod error;
mod messages;
mod metadata;
mod records;
mod scan;
mod topic;
mod writer;

pub use background::{BackgroundWriter, Inlet, Progress};
pub use bag::{Bag, BagReport, Damage, IndexEntry};
pub use error::RecordingError;
pub use messages::{Messages, RawMessage};
pub use topic::{OfferedQos, Topic, TopicOptions};
pub use writer::{BagWriter, TopicId};
