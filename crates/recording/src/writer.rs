//! Writing a bag.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};

use crate::error::{RecordingError, io_error};
use crate::metadata;
use crate::topic::{Topic, TopicOptions};

/// Messages are gathered to about this size before they are compressed together; a larger one is a chunk of its own.
const CHUNK_BYTES: u64 = 4 << 20;

/// A topic of the bag being written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TopicId {
    position: usize,
    channel: u16,
}

/// Writes a new rosbag2 folder: one chunked, zstd-compressed MCAP file with CRCs, and `metadata.yaml`.
///
/// Without [`BagWriter::finish`] there is no `metadata.yaml`; what reached the file can still be read.
pub struct BagWriter {
    folder: PathBuf,
    path: PathBuf,
    writer: mcap::Writer<BufWriter<File>>,
    topics: Vec<Topic>,
    channels: Vec<u16>,
    sequences: Vec<u32>,
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
        let file = File::create_new(&path).map_err(io_error(&path))?;
        let options = mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("rakelight ", env!("CARGO_PKG_VERSION")))
            .compression(Some(mcap::Compression::Zstd))
            // Compress on the caller's thread: chunks are written one after the other anyway.
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES));
        let writer = options.create(BufWriter::new(file)).map_err(write_error(&path))?;
        let (topics, channels, sequences) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self {
            folder,
            path,
            writer,
            topics,
            channels,
            sequences,
            span: None,
        })
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
        if let Some(position) = self.topics.iter().position(|topic| topic.name == name) {
            let known = &self.topics[position];
            if known.type_name == type_name {
                return Ok(TopicId {
                    position,
                    channel: self.channels[position],
                });
            }
            let (topic, first, second) = (name.to_owned(), known.type_name.clone(), type_name.to_owned());
            return Err(RecordingError::TopicType { topic, first, second });
        }
        let channel = self.add_channel(name, type_name, definition, options)?;
        self.topics.push(Topic {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            message_encoding: "cdr".to_owned(),
            definition_encoding: "ros2msg".to_owned(),
            definition: definition.to_owned(),
            options: options.clone(),
            message_count: 0,
        });
        self.channels.push(channel);
        self.sequences.push(0);
        Ok(TopicId {
            position: self.topics.len() - 1,
            channel,
        })
    }

    fn add_channel(
        &mut self,
        name: &str,
        type_name: &str,
        definition: &str,
        options: &TopicOptions,
    ) -> Result<u16, RecordingError> {
        let schema = self
            .writer
            .add_schema(type_name, "ros2msg", definition.as_bytes())
            .map_err(write_error(&self.path))?;
        let profiles = ("offered_qos_profiles".to_owned(), options.offered_qos_profiles.clone());
        let hash = ("topic_type_hash".to_owned(), options.type_hash.clone());
        let metadata = BTreeMap::from([profiles, hash]);
        self.writer
            .add_channel(schema, name, "cdr", &metadata)
            .map_err(write_error(&self.path))
    }

    /// Appends a serialised message, encapsulation header included; `log_time` is nanoseconds since the epoch and also
    /// becomes the publish time. Times may come in any order.
    pub fn write(&mut self, topic: TopicId, log_time: u64, cdr: &[u8]) -> Result<(), RecordingError> {
        let (channel_id, sequence) = (topic.channel, self.sequences[topic.position]);
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time,
            publish_time: log_time,
        };
        self.writer
            .write_to_known_channel(&header, cdr)
            .map_err(write_error(&self.path))?;
        self.sequences[topic.position] = sequence.wrapping_add(1);
        self.topics[topic.position].message_count += 1;
        let (first, last) = self.span.unwrap_or((log_time, log_time));
        self.span = Some((first.min(log_time), last.max(log_time)));
        Ok(())
    }

    /// Writes the index and `metadata.yaml` and waits until the disk has them.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        let file_name = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let metadata_path = self.folder.join(metadata::FILE_NAME);
        let refuse = |error: serde_yaml_ng::Error| RecordingError::Metadata {
            path: metadata_path.clone(),
            reason: error.to_string(),
        };
        let text = metadata::write(&file_name, &self.topics, self.span).map_err(refuse)?;
        // rosbag2 looks here when it is given the file without its folder.
        let content = BTreeMap::from([("serialized_metadata".to_owned(), text.clone())]);
        let record = Metadata {
            name: "rosbag2".to_owned(),
            metadata: content,
        };
        self.writer.write_metadata(&record).map_err(write_error(&self.path))?;
        self.writer.finish().map_err(write_error(&self.path))?;
        let file = self
            .writer
            .into_inner()
            .into_inner()
            .map_err(|error| io_error(&self.path)(error.into_error()))?;
        file.sync_all().map_err(io_error(&self.path))?;
        let mut file = File::create_new(&metadata_path).map_err(io_error(&metadata_path))?;
        file.write_all(text.as_bytes())
            .and_then(|()| file.sync_all())
            .map_err(io_error(&metadata_path))
    }
}

fn write_error(path: &Path) -> impl FnOnce(mcap::McapError) -> RecordingError + '_ {
    |source| RecordingError::Write {
        path: path.to_owned(),
        source,
    }
}
