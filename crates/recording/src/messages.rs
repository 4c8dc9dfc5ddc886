//! Messages of an opened bag, in the order of their log times.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;

use bytes::Bytes;

use crate::bag::Bag;
use crate::chunk::{Unpacked, unpack};
use crate::error::{RecordingError, io_error};
use crate::scan::{Block, BlockKind, Entry};
use crate::topic::Topic;

/// Unpacked chunks kept for messages that are still to come from them; at least one is always kept.
const CACHE_BYTES: usize = 64 << 20;

/// A message as recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawMessage {
    /// Topic, type and definition.
    pub topic: Arc<Topic>,
    /// When it was recorded, nanoseconds since the epoch.
    pub log_time: u64,
    /// When it was published, nanoseconds since the epoch.
    pub publish_time: u64,
    /// The serialised message with its 4-byte encapsulation header; a view into its chunk, not a copy.
    pub cdr: Bytes,
}

/// Iterator over messages. An error means that the file changed or failed after it was opened.
#[derive(Debug)]
pub struct Messages<'a> {
    bag: &'a Bag,
    /// What is still to come.
    entries: VecDeque<&'a Entry>,
    /// The file read last.
    file: Option<(usize, File)>,
    cache: VecDeque<(usize, Bytes)>,
}

impl<'a> Messages<'a> {
    pub(crate) fn new(bag: &'a Bag, wanted: impl Fn(&Topic) -> bool) -> Self {
        let wanted: Vec<bool> = bag.topics.iter().map(|topic| wanted(topic)).collect();
        let entries = bag.entries.iter().filter(|entry| wanted[entry.topic]).collect();
        Self {
            bag,
            entries,
            file: None,
            cache: VecDeque::new(),
        }
    }

    fn read(&mut self, entry: &Entry) -> Result<RawMessage, RecordingError> {
        let data = self.block(entry.block)?;
        let end = entry.start + entry.length;
        if data.len() < end {
            let changed = std::io::Error::other("the file changed while it was read");
            return Err(io_error(&self.bag.files[self.bag.blocks[entry.block].file])(changed));
        }
        let topic = Arc::clone(&self.bag.topics[entry.topic]);
        let (log_time, publish_time) = (entry.log_time, entry.publish_time);
        Ok(RawMessage {
            topic,
            log_time,
            publish_time,
            cdr: data.slice(entry.start..end),
        })
    }

    fn block(&mut self, position: usize) -> Result<Bytes, RecordingError> {
        if let Some((_, data)) = self.cache.iter().find(|(cached, _)| *cached == position) {
            return Ok(data.clone());
        }
        let data = self.load(&self.bag.blocks[position].clone())?;
        self.cache.push_back((position, data.clone()));
        while self.cache.len() > 1 && self.cache.iter().map(|(_, data)| data.len()).sum::<usize>() > CACHE_BYTES {
            self.cache.pop_front();
        }
        Ok(data)
    }

    fn load(&mut self, block: &Block) -> Result<Bytes, RecordingError> {
        let path = &self.bag.files[block.file];
        let file = match &mut self.file {
            Some((open, file)) if *open == block.file => file,
            other => &mut other.insert((block.file, File::open(path).map_err(io_error(path))?)).1,
        };
        let mut body = Vec::with_capacity(block.length as usize);
        file.seek(SeekFrom::Start(block.offset))
            .and_then(|_| file.take(block.length).read_to_end(&mut body))
            .map_err(io_error(path))?;
        let BlockKind::Chunk { cut_off } = block.kind else {
            return Ok(body.into());
        };
        match unpack(body, cut_off) {
            Unpacked::Whole(data) | Unpacked::Beginning(data) => Ok(data),
            Unpacked::Damaged(reason) | Unpacked::UnknownCompression(reason) => Err(io_error(path)(
                std::io::Error::other(format!("changed while it was read: {reason}")),
            )),
        }
    }
}

impl Iterator for Messages<'_> {
    type Item = Result<RawMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        let entry = self.entries.pop_front()?;
        Some(self.read(entry))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.entries.len(), Some(self.entries.len()))
    }
}

impl ExactSizeIterator for Messages<'_> {}
