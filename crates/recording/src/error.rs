//! Why a bag cannot be used at all. Damage inside a bag is not an error; see [`crate::BagReport`].

use std::path::{Path, PathBuf};

/// What stops reading or writing, with the file it concerns.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// File or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file begins with something else.
    #[error("{} is not an MCAP file: it {found}", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// What it begins with, in words.
        found: String,
    },
    /// A rosbag2 bag of the older storage kind.
    #[error("{} is a bag of storage {storage:?}; only mcap is read (`ros2 bag convert` makes one)", path.display())]
    UnsupportedStorage {
        /// Folder or file.
        path: PathBuf,
        /// As its metadata or its first bytes say.
        storage: String,
    },
    /// Chunks or whole files are packed in a way this crate cannot unpack.
    #[error("{}: {what} compressed with {found:?}; understood are chunks that are plain or zstd", path.display())]
    UnsupportedCompression {
        /// The file.
        path: PathBuf,
        /// What is compressed.
        what: &'static str,
        /// As the bag calls it.
        found: String,
    },
    /// `metadata.yaml` is not what rosbag2 writes.
    #[error("{}: {reason}", path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// What is wrong, with its place.
        reason: String,
    },
    /// A folder without metadata and without any `.mcap` file.
    #[error("{} holds neither metadata.yaml nor an .mcap file", path.display())]
    NoBag {
        /// The folder.
        path: PathBuf,
    },
    /// A new bag never overwrites.
    #[error("{} exists already; a bag is never overwritten", path.display())]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// The topic was added before with another type.
    #[error("topic {topic} was added as {first}, now as {second}")]
    TopicType {
        /// The topic.
        topic: String,
        /// Type at first.
        first: String,
        /// Type now.
        second: String,
    },
    /// An earlier failure has closed the bag.
    #[error("{} was closed when writing to it failed; nothing more is written", path.display())]
    Closed {
        /// The file.
        path: PathBuf,
    },
    /// Writing MCAP failed.
    #[error("{}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The format library's reason.
        source: mcap::McapError,
    },
}

/// For `map_err` on system calls about `path`.
pub(crate) fn io_error(path: &Path) -> impl FnOnce(std::io::Error) -> RecordingError + '_ {
    |source| RecordingError::Io {
        path: path.to_owned(),
        source,
    }
}
