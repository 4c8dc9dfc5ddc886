//! Writing a bag.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;

use crate::error::{RecordingError, io_error};
use crate::metadata;
use crate::records::EMPTY_END;
use crate::topic::{Topic, TopicOptions};

/// Messages are gathered to about this size before they are compressed together; a larger one is a chunk of its own.
const CHUNK_BYTES: u64 = 4 << 20;

/// On 12-bit images with their noise (two cores, one in use): level 1 packs 350 MB/s to 1 / 2.05, level 3 130 MB/s to
/// 1 / 2.20, level -1 350 MB/s to 1 / 1.36.
const COMPRESSION_LEVEL: u32 = 1;

/// A topic of the bag being written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TopicId {
    position: usize,
    channel: u16,
}

/// Writes a new rosbag2 folder: one chunked, zstd-compressed MCAP file with CRCs, and `metadata.yaml`.
///
/// Chunks reach the file whole: when one is full, and with [`BagWriter::flush`]. What the file has then outlives the
/// process, however that ends. Without [`BagWriter::finish`] there is no `metadata.yaml`; what reached the file can
/// still be read.
///
/// When the disk refuses (it is full, say), the call that notices gives the error, the bag is closed with the chunks
/// that are whole, readable by everybody, and every later call gives [`RecordingError::Closed`].
pub struct BagWriter {
    folder: PathBuf,
    path: PathBuf,
    /// Shared with the writer below, to cut off what it could not complete.
    file: Arc<File>,
    /// None once the bag is closed.
    writer: Option<McapWriter>,
    topics: Vec<Topic>,
    channels: Vec<u16>,
    sequences: Vec<u32>,
    /// Bytes of messages that no chunk in the file holds yet.
    unflushed: u64,
    whole: Whole,
    span: Option<(u64, u64)>,
}

type McapWriter = mcap::Writer<NoSeek<BufWriter<Arc<File>>>>;

/// What is in the file for good.
#[derive(Default)]
struct Whole {
    length: u64,
    messages: Vec<u64>,
    span: Option<(u64, u64)>,
}

impl BagWriter {
    /// Creates the folder, which must not exist; the file in it carries its name.
    pub fn create(folder: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let folder = folder.as_ref().to_owned();
        std::fs::create_dir(&folder).map_err(|error| match error.kind() {
            std::io::ErrorKind::AlreadyExists => RecordingError::Exists { path: folder.clone() },
            _ => io_error(&folder)(error),
        })?;
        let name = folder
            .file_name()
            .map_or_else(|| "bag".into(), |name| name.to_string_lossy().into_owned());
        let path = folder.join(format!("{name}.mcap"));
        let file = Arc::new(File::create_new(&path).map_err(io_error(&path))?);
        let writer = write_options()
            .create(NoSeek::new(BufWriter::new(Arc::clone(&file))))
            .map_err(write_error(&path))?;
        let mut bag = Self {
            folder,
            path,
            file,
            writer: Some(writer),
            topics: Vec::new(),
            channels: Vec::new(),
            sequences: Vec::new(),
            unflushed: 0,
            whole: Whole::default(),
            span: None,
        };
        bag.flush()?;
        Ok(bag)
    }

    /// Announces a topic of CDR messages; the same name and type again give the same topic. `definition` is the
    /// message's text with its dependencies, as `ros2msg` schemas hold it.
    pub fn add_topic(
        &mut self,
        name: &str,
        type_name: &str,
        definition: &str,
        options: &TopicOptions,
    ) -> Result<TopicId, RecordingError> {
        self.add_topic_like(&Topic {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            message_encoding: "cdr".to_owned(),
            definition_encoding: "ros2msg".to_owned(),
            definition: definition.to_owned(),
            options: options.clone(),
            message_count: 0,
        })
    }

    /// Announces a topic as another bag has it, whatever its encodings; the same name and type again give the same
    /// topic.
    pub fn add_topic_like(&mut self, topic: &Topic) -> Result<TopicId, RecordingError> {
        if let Some(position) = self.topics.iter().position(|known| known.name == topic.name) {
            let known = &self.topics[position];
            if known.type_name == topic.type_name {
                let channel = self.channels[position];
                return Ok(TopicId { position, channel });
            }
            let (topic, first, second) = (topic.name.clone(), known.type_name.clone(), topic.type_name.clone());
            return Err(RecordingError::TopicType { topic, first, second });
        }
        let channel = self.attempt(|writer| add_channel(writer, topic))?;
        let message_count = 0;
        self.topics.push(Topic {
            message_count,
            ..topic.clone()
        });
        self.channels.push(channel);
        self.sequences.push(0);
        let position = self.topics.len() - 1;
        Ok(TopicId { position, channel })
    }

    /// Appends a serialised message, encapsulation header included; `log_time` is nanoseconds since the epoch and also
    /// becomes the publish time. Times may come in any order.
    pub fn write(&mut self, topic: TopicId, log_time: u64, cdr: &[u8]) -> Result<(), RecordingError> {
        self.write_published(topic, log_time, log_time, cdr)
    }

    /// [`Self::write`] with a publish time of its own.
    pub fn write_published(
        &mut self,
        topic: TopicId,
        log_time: u64,
        publish_time: u64,
        cdr: &[u8],
    ) -> Result<(), RecordingError> {
        let (channel_id, sequence) = (topic.channel, self.sequences[topic.position]);
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time,
            publish_time,
        };
        self.attempt(|writer| writer.write_to_known_channel(&header, cdr))?;
        self.sequences[topic.position] = sequence.wrapping_add(1);
        self.topics[topic.position].message_count += 1;
        let (first, last) = self.span.unwrap_or((log_time, log_time));
        self.span = Some((first.min(log_time), last.max(log_time)));
        self.unflushed += cdr.len() as u64;
        if self.unflushed >= CHUNK_BYTES {
            self.flush()?;
        }
        Ok(())
    }

    /// Ends the chunk and hands it to the system: everything written so far outlives this process.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.attempt(mcap::Writer::flush)?;
        let length = self.file.metadata().map_err(io_error(&self.path))?.len();
        self.unflushed = 0;
        self.whole = Whole {
            length,
            messages: self.topics.iter().map(|topic| topic.message_count).collect(),
            span: self.span,
        };
        Ok(())
    }

    /// True while there are messages that only a [`Self::flush`] or a full chunk brings into the file.
    pub fn is_pending(&self) -> bool {
        self.unflushed > 0
    }

    /// The bag's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Messages that are in the file for good.
    pub fn safe_messages(&self) -> u64 {
        self.whole.messages.iter().sum()
    }

    /// Bytes of the file that are there for good.
    pub fn safe_bytes(&self) -> u64 {
        self.whole.length
    }

    /// Writes the index and `metadata.yaml` and waits until the disk has them.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.flush()?;
        let text = self.metadata_text()?;
        // rosbag2 looks here when it is given the file without its folder.
        let record = Metadata {
            name: "rosbag2".to_owned(),
            metadata: BTreeMap::from([("serialized_metadata".to_owned(), text.clone())]),
        };
        self.attempt(|writer| writer.write_metadata(&record))?;
        if let Some(writer) = self.writer.take() {
            end(writer).map_err(|source| {
                self.close_short();
                write_error(&self.path)(source)
            })?;
        }
        self.file.sync_all().map_err(io_error(&self.path))?;
        self.write_metadata_file(&text)
    }

    /// Calls the writer; when it fails, the bag is closed with what is whole.
    fn attempt<T>(&mut self, call: impl FnOnce(&mut McapWriter) -> mcap::McapResult<T>) -> Result<T, RecordingError> {
        let Some(writer) = &mut self.writer else {
            return Err(RecordingError::Closed {
                path: self.path.clone(),
            });
        };
        call(writer).map_err(|source| {
            self.close_short();
            write_error(&self.path)(source)
        })
    }

    /// Ends the file behind its last whole chunk. Cutting off the broken one makes the room that the end needs; if there
    /// is none, the bag stays without an end, which readers of damaged bags cope with.
    fn close_short(&mut self) {
        // Whatever it still wants to write is cut off below.
        self.writer = None;
        for (topic, messages) in self.topics.iter_mut().zip(&self.whole.messages) {
            topic.message_count = *messages;
        }
        self.topics.truncate(self.whole.messages.len());
        self.span = self.whole.span;
        let mut file = &*self.file;
        let ended = file
            .set_len(self.whole.length)
            .and_then(|()| file.seek(SeekFrom::Start(self.whole.length)))
            .and_then(|_| file.write_all(&EMPTY_END))
            .and_then(|()| file.sync_all());
        if ended.is_ok()
            && let Ok(text) = self.metadata_text()
        {
            // The error that led here is the one to report.
            let _ = self.write_metadata_file(&text);
        }
    }

    fn metadata_text(&self) -> Result<String, RecordingError> {
        let file_name = self.path.file_name().unwrap_or_default().to_string_lossy();
        metadata::write(&file_name, &self.topics, self.span).map_err(|error| RecordingError::Metadata {
            path: self.folder.join(metadata::FILE_NAME),
            reason: error.to_string(),
        })
    }

    fn write_metadata_file(&self, text: &str) -> Result<(), RecordingError> {
        let path = self.folder.join(metadata::FILE_NAME);
        let mut file = File::create_new(&path).map_err(io_error(&path))?;
        let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
        written.map_err(|error| {
            // Half a file would hide the bag from everybody; none makes readers look for themselves.
            let _ = std::fs::remove_file(&path);
            io_error(&path)(error)
        })
    }
}

fn write_options() -> mcap::WriteOptions {
    mcap::WriteOptions::new()
        .profile("ros2")
        .library(concat!("rakelight ", env!("CARGO_PKG_VERSION")))
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(COMPRESSION_LEVEL)
        // Compress on the caller's thread: chunks are written one after the other anyway.
        .compression_threads(0)
        // Chunks are ended by `flush`, and gathered in memory: so the file never has one with a header to be filled in.
        .chunk_size(None)
        .disable_seeking(true)
}

/// Writes index and footer, and hands everything to the system.
fn end(mut writer: McapWriter) -> mcap::McapResult<()> {
    writer.finish()?;
    Ok(writer.into_inner().into_inner().flush()?)
}

fn add_channel(writer: &mut McapWriter, topic: &Topic) -> mcap::McapResult<u16> {
    let schema = match topic.type_name.as_str() {
        "" => 0,
        name => writer.add_schema(name, &topic.definition_encoding, topic.definition.as_bytes())?,
    };
    let options = &topic.options;
    let profiles = ("offered_qos_profiles".to_owned(), options.offered_qos_profiles.clone());
    let hash = ("topic_type_hash".to_owned(), options.type_hash.clone());
    let metadata = BTreeMap::from([profiles, hash]);
    writer.add_channel(schema, &topic.name, &topic.message_encoding, &metadata)
}

/// The system's reason where there is one: the library's own words for it hide that the disk is full.
fn write_error(path: &Path) -> impl FnOnce(mcap::McapError) -> RecordingError + '_ {
    let path = path.to_owned();
    |source| match source {
        mcap::McapError::Io(source) => RecordingError::Io { path, source },
        source => RecordingError::Write { path, source },
    }
}
