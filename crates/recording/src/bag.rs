//! Opening a bag.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{RecordingError, io_error};
use crate::messages::Messages;
use crate::metadata;
use crate::scan::{Block, Entry, Index, scan};
use crate::topic::Topic;

/// A bag that was read once and can be iterated any number of times.
#[derive(Debug)]
pub struct Bag {
    pub(crate) files: Vec<PathBuf>,
    pub(crate) topics: Vec<Arc<Topic>>,
    pub(crate) blocks: Vec<Block>,
    /// In the order of log times.
    pub(crate) entries: Vec<Entry>,
    report: BagReport,
}

/// What was found in a bag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BagReport {
    /// The MCAP files read.
    pub files: Vec<PathBuf>,
    /// Messages that can be read.
    pub messages: usize,
    /// Log time of the first and the last of them, nanoseconds since the epoch.
    pub span: Option<(u64, u64)>,
    /// What cannot be read, in the order of the files.
    pub damage: Vec<Damage>,
}

/// What the index knows of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IndexEntry<'a> {
    /// Its topic.
    pub topic: &'a Arc<Topic>,
    /// When it was recorded, nanoseconds since the epoch.
    pub log_time: u64,
    /// Its size, serialised.
    pub bytes: usize,
}

impl BagReport {
    /// True when nothing is missing.
    pub fn is_whole(&self) -> bool {
        self.damage.is_empty()
    }
}

/// A place in a bag that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// The file.
    pub file: PathBuf,
    /// Byte at which it begins.
    pub offset: u64,
    /// What is wrong there.
    pub reason: String,
}

impl std::fmt::Display for Damage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "{} at byte {}: {}",
            self.file.display(),
            self.offset,
            self.reason
        )
    }
}

impl Bag {
    /// Opens a `.mcap` file or a rosbag2 folder and reads all of it once.
    ///
    /// Fails only when there is nothing to read: a missing file, another format, a compression this crate does not
    /// know. Damage and missing ends are reported instead.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let mut index = Index::default();
        let files = files_of(path, &mut index)?;
        for (position, file) in files.iter().enumerate() {
            scan(file, position, &mut index)?;
        }
        // Stable: messages of one time keep the order in which they were written.
        index.entries.sort_by_key(|entry| entry.log_time);
        let span = index
            .entries
            .first()
            .zip(index.entries.last())
            .map(|(first, last)| (first.log_time, last.log_time));
        let report = BagReport {
            files: files.clone(),
            messages: index.entries.len(),
            span,
            damage: index.damage,
        };
        let topics = index.topics.into_iter().map(Arc::new).collect();
        Ok(Self {
            files,
            topics,
            blocks: index.blocks,
            entries: index.entries,
            report,
        })
    }

    /// Every topic that was announced, also those without a message.
    pub fn topics(&self) -> &[Arc<Topic>] {
        &self.topics
    }

    /// What was found, and what is damaged.
    pub fn report(&self) -> &BagReport {
        &self.report
    }

    /// Topic, log time and size of every message, in the order of the log times; nothing is unpacked for it.
    pub fn index(&self) -> impl ExactSizeIterator<Item = IndexEntry<'_>> {
        self.entries.iter().map(|entry| IndexEntry {
            topic: &self.topics[entry.topic],
            log_time: entry.log_time,
            bytes: entry.length,
        })
    }

    /// All messages in the order of their log times.
    pub fn messages(&self) -> Messages<'_> {
        Messages::new(self, |_| true)
    }

    /// The messages of some topics in the order of their log times; the others are not unpacked.
    pub fn messages_where(&self, wanted: impl Fn(&Topic) -> bool) -> Messages<'_> {
        Messages::new(self, wanted)
    }
}

fn files_of(path: &Path, index: &mut Index) -> Result<Vec<PathBuf>, RecordingError> {
    if !std::fs::metadata(path).map_err(io_error(path))?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    if let Some(files) = metadata::read_files(path)? {
        return Ok(files);
    }
    let mut files = mcap_files(path)?;
    files.sort();
    if files.is_empty() {
        return Err(RecordingError::NoBag { path: path.to_owned() });
    }
    let reason = "metadata.yaml is missing: the recording was not finished".to_owned();
    index.damage.push(Damage {
        file: path.to_owned(),
        offset: 0,
        reason,
    });
    Ok(files)
}

fn mcap_files(folder: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let entries = std::fs::read_dir(folder)
        .and_then(Iterator::collect::<Result<Vec<_>, _>>)
        .map_err(io_error(folder))?;
    let paths = entries.into_iter().map(|entry| entry.path());
    Ok(paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .collect())
}
