//! One pass over an MCAP file: what is in it, where, and what is damaged.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{MessageHeader, Record, op};

use crate::bag::Damage;
use crate::chunk::{Unpacked, unpack};
use crate::error::{RecordingError, io_error};
use crate::records::{HEADER_BYTES, InnerRecords, record_header};
use crate::topic::{Topic, TopicOptions};

/// Bytes of a message record before its data: channel, sequence, log time, publish time.
const MESSAGE_HEADER_BYTES: usize = 2 + 4 + 8 + 8;

/// A stretch of a file that is read at once: a chunk, or a message outside of chunks.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    pub(crate) file: usize,
    pub(crate) offset: u64,
    pub(crate) length: u64,
    pub(crate) kind: BlockKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlockKind {
    Chunk { cut_off: bool },
    Message,
}

/// Where one message's data lies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) log_time: u64,
    pub(crate) publish_time: u64,
    pub(crate) topic: usize,
    pub(crate) block: usize,
    /// Within the unpacked block.
    pub(crate) start: usize,
    pub(crate) length: usize,
}

/// What all files of a bag hold together.
#[derive(Debug, Default)]
pub(crate) struct Index {
    pub(crate) topics: Vec<Topic>,
    pub(crate) blocks: Vec<Block>,
    pub(crate) entries: Vec<Entry>,
    pub(crate) damage: Vec<Damage>,
}

struct SchemaText {
    name: String,
    encoding: String,
    data: String,
}

/// State of the pass over one file.
struct Scan<'a> {
    index: &'a mut Index,
    path: &'a Path,
    file: usize,
    schemas: HashMap<u16, SchemaText>,
    /// Position in `index.topics` by channel id.
    channels: HashMap<u16, usize>,
    /// Messages before their channel's description: its first copy was lost, the summary may hold another.
    orphans: Vec<(u16, Entry)>,
}

/// Adds what `path` holds to the index; `file` is its position among the bag's files.
pub(crate) fn scan(path: &Path, file: usize, index: &mut Index) -> Result<(), RecordingError> {
    let opened = File::open(path).map_err(io_error(path))?;
    let length = opened.metadata().map_err(io_error(path))?.len();
    let mut reader = BufReader::new(opened);
    check_magic(path, &mut reader)?;
    let mut scan = Scan {
        index,
        path,
        file,
        schemas: HashMap::new(),
        channels: HashMap::new(),
        orphans: Vec::new(),
    };
    scan.records(&mut reader, length)?;
    scan.adopt_orphans(length);
    Ok(())
}

fn check_magic(path: &Path, reader: &mut impl Read) -> Result<(), RecordingError> {
    let mut start = Vec::new();
    reader.take(16).read_to_end(&mut start).map_err(io_error(path))?;
    if start.starts_with(mcap::MAGIC) {
        return Ok(());
    }
    let path = path.to_owned();
    if start.starts_with(b"SQLite format 3\0") {
        return Err(RecordingError::UnsupportedStorage {
            path,
            storage: "sqlite3".to_owned(),
        });
    }
    let found = match start.as_slice() {
        [] => "is empty".to_owned(),
        some if mcap::MAGIC.starts_with(some) => format!("ends after {} bytes of the magic", some.len()),
        some => format!("begins with {:02x?}", &some[..some.len().min(8)]),
    };
    Err(RecordingError::NotMcap { path, found })
}

impl Scan<'_> {
    fn report(&mut self, offset: u64, reason: String) {
        self.index.damage.push(Damage {
            file: self.path.to_owned(),
            offset,
            reason,
        });
    }

    /// Walks the records of the file until its end or until the framing is lost.
    fn records(&mut self, reader: &mut (impl Read + Seek), length: u64) -> Result<(), RecordingError> {
        let mut position = mcap::MAGIC.len() as u64;
        let mut after_footer = false;
        loop {
            reader.seek(SeekFrom::Start(position)).map_err(io_error(self.path))?;
            let mut header = Vec::with_capacity(HEADER_BYTES);
            reader
                .take(HEADER_BYTES as u64)
                .read_to_end(&mut header)
                .map_err(io_error(self.path))?;
            if after_footer && header == mcap::MAGIC {
                return Ok(());
            }
            let Ok(header) = <[u8; HEADER_BYTES]>::try_from(header) else {
                self.report(
                    position,
                    "the file ends here, without the footer of a finished recording".to_owned(),
                );
                return Ok(());
            };
            let (opcode, body_length) = record_header(header);
            let body_start = position + HEADER_BYTES as u64;
            let available = body_length.min(length.saturating_sub(body_start));
            let cut_off = available < body_length;
            self.record(reader, opcode, (body_start, available), cut_off)?;
            if cut_off {
                let reason = format!(
                    "a record (opcode {opcode:#04x}) of {body_length} bytes begins here, {available} are there"
                );
                self.report(position, reason);
                return Ok(());
            }
            after_footer = opcode == op::FOOTER;
            position = body_start + body_length;
        }
    }

    /// One record of the file, at `(offset, length)` as far as it is there.
    fn record(
        &mut self,
        reader: &mut impl Read,
        opcode: u8,
        (offset, length): (u64, u64),
        cut_off: bool,
    ) -> Result<(), RecordingError> {
        let wanted = matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK);
        if !wanted || (cut_off && opcode != op::CHUNK) {
            return Ok(());
        }
        let mut body = Vec::with_capacity(length as usize);
        reader
            .take(length)
            .read_to_end(&mut body)
            .map_err(io_error(self.path))?;
        if opcode == op::CHUNK {
            return self.chunk(body, (offset, length), cut_off);
        }
        if opcode == op::MESSAGE {
            self.index.blocks.push(Block {
                file: self.file,
                offset,
                length,
                kind: BlockKind::Message,
            });
        }
        self.content(opcode, &body, 0, offset);
        Ok(())
    }

    fn chunk(&mut self, body: Vec<u8>, (offset, length): (u64, u64), cut_off: bool) -> Result<(), RecordingError> {
        let data = match unpack(body, cut_off) {
            Unpacked::Whole(data) | Unpacked::Beginning(data) => data,
            Unpacked::Damaged(reason) => {
                self.report(offset, reason);
                return Ok(());
            }
            Unpacked::UnknownCompression(found) => {
                let (path, what) = (self.path.to_owned(), "chunks are");
                return Err(RecordingError::UnsupportedCompression { path, what, found });
            }
        };
        self.index.blocks.push(Block {
            file: self.file,
            offset,
            length,
            kind: BlockKind::Chunk { cut_off },
        });
        let mut records = InnerRecords::new(&data);
        for record in records.by_ref() {
            self.content(record.opcode, record.body, record.start, offset);
        }
        if !records.is_exhausted() && !cut_off {
            self.report(offset, "a record leaves its chunk".to_owned());
        }
        Ok(())
    }

    /// A schema, channel or message; `start` is where the body begins in the block pushed last.
    fn content(&mut self, opcode: u8, body: &[u8], start: usize, offset: u64) {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return;
        }
        match mcap::parse_record(opcode, body) {
            Ok(Record::Schema { header, data }) => {
                let data = String::from_utf8_lossy(&data).into_owned();
                self.schemas.insert(
                    header.id,
                    SchemaText {
                        name: header.name,
                        encoding: header.encoding,
                        data,
                    },
                );
            }
            Ok(Record::Channel(channel)) => self.channel(channel),
            Ok(Record::Message { header, data }) => self.message(&header, start + MESSAGE_HEADER_BYTES, data.len()),
            Ok(_) => {}
            Err(error) => self.report(
                offset,
                format!("a record (opcode {opcode:#04x}) cannot be read: {error}"),
            ),
        }
    }

    /// Channels of one name and type, in several files or after a publisher's restart, are one topic.
    fn channel(&mut self, mut channel: mcap::records::Channel) {
        let schema = self.schemas.get(&channel.schema_id);
        let text = |part: fn(&SchemaText) -> &String| schema.map(part).cloned().unwrap_or_default();
        let mut metadata = |key: &str| channel.metadata.remove(key).unwrap_or_default();
        let options = TopicOptions {
            offered_qos_profiles: metadata("offered_qos_profiles"),
            type_hash: metadata("topic_type_hash"),
        };
        let topic = Topic {
            name: channel.topic,
            type_name: text(|schema| &schema.name),
            message_encoding: channel.message_encoding,
            definition_encoding: text(|schema| &schema.encoding),
            definition: text(|schema| &schema.data),
            options,
            message_count: 0,
        };
        let topics = &mut self.index.topics;
        let known = topics
            .iter()
            .position(|known| known.name == topic.name && known.type_name == topic.type_name);
        let position = known.unwrap_or_else(|| {
            topics.push(topic);
            topics.len() - 1
        });
        self.channels.insert(channel.id, position);
    }

    fn message(&mut self, header: &MessageHeader, start: usize, length: usize) {
        let block = self.index.blocks.len() - 1;
        let (log_time, publish_time) = (header.log_time, header.publish_time);
        let entry = Entry {
            log_time,
            publish_time,
            topic: usize::MAX,
            block,
            start,
            length,
        };
        match self.channels.get(&header.channel_id) {
            Some(&topic) => self.add(entry, topic),
            None => self.orphans.push((header.channel_id, entry)),
        }
    }

    fn add(&mut self, entry: Entry, topic: usize) {
        self.index.topics[topic].message_count += 1;
        self.index.entries.push(Entry { topic, ..entry });
    }

    fn adopt_orphans(&mut self, file_length: u64) {
        let mut lost = 0;
        for (channel, entry) in std::mem::take(&mut self.orphans) {
            match self.channels.get(&channel) {
                Some(&topic) => self.add(entry, topic),
                None => lost += 1,
            }
        }
        if lost > 0 {
            self.report(
                file_length,
                format!("{lost} messages belong to channels whose description is lost"),
            );
        }
    }
}
