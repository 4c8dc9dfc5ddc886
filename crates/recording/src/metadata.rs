//! rosbag2's `metadata.yaml`.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_yaml_ng::Value;

use crate::error::{RecordingError, io_error};
use crate::topic::Topic;

/// Name of the file in a bag folder.
pub(crate) const FILE_NAME: &str = "metadata.yaml";
/// The layout written here, that of ROS 2 Jazzy and later.
const VERSION: u32 = 9;

/// What the reader needs of any version.
#[derive(Deserialize)]
struct Read {
    rosbag2_bagfile_information: ReadInformation,
}

#[derive(Deserialize)]
struct ReadInformation {
    storage_identifier: String,
    relative_file_paths: Vec<PathBuf>,
    #[serde(default)]
    compression_format: String,
    #[serde(default)]
    compression_mode: String,
}

/// The files a bag folder names; none without `metadata.yaml`.
pub(crate) fn read_files(folder: &Path) -> Result<Option<Vec<PathBuf>>, RecordingError> {
    let path = folder.join(FILE_NAME);
    let text = match std::fs::read_to_string(&path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        other => other.map_err(io_error(&path))?,
    };
    let refuse = |reason: String| RecordingError::Metadata {
        path: path.clone(),
        reason,
    };
    let read: Read = serde_yaml_ng::from_str(&text).map_err(|error| refuse(error.to_string()))?;
    let information = read.rosbag2_bagfile_information;
    if information.storage_identifier != "mcap" {
        let (path, storage) = (folder.to_owned(), information.storage_identifier);
        return Err(RecordingError::UnsupportedStorage { path, storage });
    }
    if !matches!(information.compression_mode.to_lowercase().as_str(), "" | "none") {
        let what = if information.compression_mode.eq_ignore_ascii_case("file") {
            "files are"
        } else {
            "messages are"
        };
        let found = information.compression_format;
        return Err(RecordingError::UnsupportedCompression { path, what, found });
    }
    if information.relative_file_paths.is_empty() {
        return Err(refuse("relative_file_paths names no file".to_owned()));
    }
    Ok(Some(
        information
            .relative_file_paths
            .iter()
            .map(|file| folder.join(file))
            .collect(),
    ))
}

#[derive(Serialize)]
struct Nanoseconds {
    nanoseconds: u64,
}

#[derive(Serialize)]
struct SinceEpoch {
    nanoseconds_since_epoch: u64,
}

#[derive(Serialize)]
struct Written<'a> {
    rosbag2_bagfile_information: Information<'a>,
}

#[derive(Serialize)]
struct Information<'a> {
    version: u32,
    storage_identifier: &'a str,
    duration: Nanoseconds,
    starting_time: SinceEpoch,
    message_count: u64,
    topics_with_message_count: Vec<TopicCount<'a>>,
    compression_format: &'a str,
    compression_mode: &'a str,
    relative_file_paths: [&'a str; 1],
    files: [FileInformation<'a>; 1],
    custom_data: Value,
    ros_distro: &'a str,
}

#[derive(Serialize)]
struct FileInformation<'a> {
    path: &'a str,
    starting_time: SinceEpoch,
    duration: Nanoseconds,
    message_count: u64,
}

#[derive(Serialize)]
struct TopicCount<'a> {
    topic_metadata: TopicMetadata<'a>,
    message_count: u64,
}

#[derive(Serialize)]
struct TopicMetadata<'a> {
    name: &'a str,
    r#type: &'a str,
    serialization_format: &'a str,
    offered_qos_profiles: Value,
    type_description_hash: &'a str,
}

/// The text of `metadata.yaml` for a bag of one file; `span` holds the first and the last log time.
pub(crate) fn write(
    file_name: &str,
    topics: &[Topic],
    span: Option<(u64, u64)>,
) -> Result<String, serde_yaml_ng::Error> {
    let (first, last) = span.unwrap_or_default();
    let message_count = topics.iter().map(|topic| topic.message_count).sum();
    let duration = || Nanoseconds {
        nanoseconds: last - first,
    };
    let starting_time = || SinceEpoch {
        nanoseconds_since_epoch: first,
    };
    serde_yaml_ng::to_string(&Written {
        rosbag2_bagfile_information: Information {
            version: VERSION,
            storage_identifier: "mcap",
            duration: duration(),
            starting_time: starting_time(),
            message_count,
            topics_with_message_count: topics.iter().map(topic_count).collect(),
            // These two mean compression of whole files or messages around the storage; chunks are the storage's own.
            compression_format: "",
            compression_mode: "",
            relative_file_paths: [file_name],
            files: [FileInformation {
                path: file_name,
                starting_time: starting_time(),
                duration: duration(),
                message_count,
            }],
            custom_data: Value::Null,
            ros_distro: "rakelight",
        },
    })
}

fn topic_count(topic: &Topic) -> TopicCount<'_> {
    let profiles = serde_yaml_ng::from_str(&topic.options.offered_qos_profiles)
        .ok()
        .filter(Value::is_sequence);
    TopicCount {
        topic_metadata: TopicMetadata {
            name: &topic.name,
            r#type: &topic.type_name,
            serialization_format: &topic.message_encoding,
            offered_qos_profiles: profiles.unwrap_or(Value::Sequence(Vec::new())),
            type_description_hash: &topic.options.type_hash,
        },
        message_count: topic.message_count,
    }
}
