//! Bags written by rosbags, read here; and what is no bag.

mod common;

use std::path::Path;
use std::process::Command;

use common::{all, python, shared};
use recording::{Bag, BagWriter, RawMessage, RecordingError};

const BAGS: [&str; 2] = ["bag_mcap", "bag_mcap_zstd_storage"];

#[test]
fn topics_types_and_times_of_other_writers_bags() {
    let Some(folder) = shared("data/bags") else { return };
    for name in BAGS {
        let bag = Bag::open(folder.join(name)).unwrap();
        assert!(bag.report().is_whole(), "{name}: {:?}", bag.report().damage);
        assert_eq!((bag.report().messages, bag.topics().len()), (35, 7));
        assert_eq!(
            bag.report().span,
            Some((1_700_000_000_000_000_000, 1_700_000_000_400_000_000))
        );
        let mono16 = bag.topics().iter().find(|topic| topic.name == "/cam/mono16").unwrap();
        assert_eq!(
            (mono16.type_name.as_str(), mono16.message_encoding.as_str()),
            ("sensor_msgs/msg/Image", "cdr")
        );
        assert!(mono16.definition.contains("std_msgs/Header"), "{}", mono16.definition);
        assert_eq!(mono16.message_count, 5);
        let messages = all(&bag);
        assert_eq!(messages.len(), 35);
        assert!(messages.is_sorted_by_key(|message| message.log_time));
        assert_eq!(bag.messages_where(|topic| topic.name == "/note").count(), 5);
    }
}

#[test]
fn plain_and_compressed_storage_give_the_same_messages() {
    let Some(folder) = shared("data/bags") else { return };
    let [plain, packed] = BAGS.map(|name| all(&Bag::open(folder.join(name)).unwrap()));
    for (a, b) in plain.iter().zip(&packed) {
        assert_eq!((a.log_time, &a.topic.name, &a.cdr), (b.log_time, &b.topic.name, &b.cdr));
    }
}

#[test]
fn a_single_file_reads_like_its_folder() {
    let Some(folder) = shared("data/bags/bag_mcap") else {
        return;
    };
    let from_file = all(&Bag::open(folder.join("bag_mcap.mcap")).unwrap());
    assert_eq!(from_file, all(&Bag::open(&folder).unwrap()));
}

#[test]
fn the_bag_of_the_demo_is_whole_and_complete() {
    let bag = Bag::open(common::root().join("bags/octagon2")).unwrap();
    assert!(bag.report().is_whole(), "{:?}", bag.report().damage);
    for camera in ["c1", "c2"] {
        for (topic, type_name) in [
            ("image_raw", "sensor_msgs/msg/Image"),
            ("camera_info", "sensor_msgs/msg/CameraInfo"),
            ("exposure", "rakelight_msgs/msg/Exposure"),
        ] {
            let name = format!("/cell/{camera}/{topic}");
            let found = bag
                .topics()
                .iter()
                .find(|topic| topic.name == name)
                .unwrap_or_else(|| panic!("no {name}"));
            assert_eq!(
                (found.message_count, found.type_name.as_str()),
                (8, type_name),
                "{name}"
            );
        }
    }
    // An image's data, 512 x 512 of two bytes, after its header.
    let images = bag.messages_where(|topic| topic.name.ends_with("image_raw"));
    assert!(
        images
            .map(Result::unwrap)
            .all(|message| message.cdr.len() > 512 * 512 * 2)
    );
}

#[test]
fn sqlite_bags_are_refused_by_name() {
    let Some(folder) = shared("data/bags") else { return };
    for path in ["bag_sqlite3", "bag_sqlite3_zstd_msg", "bag_sqlite3/bag_sqlite3.db3"] {
        let error = Bag::open(folder.join(path)).unwrap_err();
        let named = matches!(&error, RecordingError::UnsupportedStorage { storage, .. } if storage == "sqlite3");
        assert!(
            named && error.to_string().contains("only mcap is read"),
            "{path}: {error}"
        );
    }
}

#[test]
fn what_is_no_bag_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        Bag::open(path).unwrap_err().to_string()
    };
    assert!(file("empty.mcap", b"").ends_with("is not an MCAP file: it is empty"));
    assert!(file("text.mcap", b"hello, bag").contains("it begins with [68, 65, 6c"));
    assert!(file("short.mcap", b"\x89MC").contains("it ends after 3 bytes of the magic"));
    let missing = Bag::open(folder.path().join("nowhere")).unwrap_err();
    assert!(
        matches!(missing, RecordingError::Io { .. }) && missing.to_string().contains("nowhere"),
        "{missing}"
    );
    let empty = tempfile::tempdir().unwrap();
    assert!(matches!(Bag::open(empty.path()), Err(RecordingError::NoBag { .. })));
}

#[test]
fn unreadable_metadata_and_compression_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let open_with = |text: &str| {
        std::fs::write(folder.path().join("metadata.yaml"), text).unwrap();
        Bag::open(folder.path()).unwrap_err()
    };
    assert!(matches!(
        open_with("rosbag2_bagfile_information: 3"),
        RecordingError::Metadata { .. }
    ));
    let information = |extra: &str| {
        format!("rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths: [a.mcap]\n{extra}")
    };
    let packed = open_with(&information("  compression_mode: FILE\n  compression_format: zstd\n"));
    assert!(
        packed.to_string().contains("files are compressed with \"zstd\""),
        "{packed}"
    );
    let absent = open_with(&information(""));
    assert!(
        matches!(absent, RecordingError::Io { .. }) && absent.to_string().contains("a.mcap"),
        "{absent}"
    );
}

#[test]
fn a_chunk_of_unknown_compression_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lz4.mcap");
    let name = b"lz4";
    let mut body = vec![0; 8 + 8 + 8 + 4];
    body.extend((name.len() as u32).to_le_bytes());
    body.extend(name);
    body.extend(0_u64.to_le_bytes());
    let mut file = b"\x89MCAP0\r\n\x06".to_vec();
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
    std::fs::write(&path, file).unwrap();
    let error = Bag::open(&path).unwrap_err();
    assert!(
        error.to_string().contains("chunks are compressed with \"lz4\""),
        "{error}"
    );
}

#[test]
fn other_writers_messages_are_the_bytes_that_they_wrote() {
    let (Some(folder), Some(python)) = (shared("data/bags"), python()) else {
        return;
    };
    let script = r"
import sys, zlib, numpy
expected = numpy.load(sys.argv[1])
for key in sorted(expected.files):
    print(key[3:], zlib.crc32(expected[key].tobytes()))
";
    let output = Command::new(python)
        .args(["-c", script])
        .arg(folder.join("expected.npz"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let expected = String::from_utf8(output.stdout).unwrap();
    for name in BAGS {
        let bag = Bag::open(folder.join(name)).unwrap();
        let mut read: Vec<String> = all(&bag).iter().map(topic_and_crc).collect();
        let mut expected: Vec<&str> = expected.lines().collect();
        read.sort();
        expected.sort_unstable();
        assert_eq!(read, expected, "{name}");
    }
}

fn topic_and_crc(message: &RawMessage) -> String {
    format!("{} {}", message.topic.name, crc32fast::hash(&message.cdr))
}

/// A file by the reference writer in Python: backwards in time, a topic of another encoding and one without a schema
/// beside, and no index at all.
const UNUSUAL: &str = r#"
import sys
from mcap.writer import CompressionType, IndexType, Writer
compression = CompressionType[sys.argv[2]]
with open(sys.argv[1], "wb") as stream:
    writer = Writer(stream, chunk_size=200, compression=compression, index_types=IndexType.NONE,
                    repeat_channels=False, repeat_schemas=False, use_statistics=False, use_summary_offsets=False)
    writer.start(profile="ros2", library="other")
    text = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
    note = writer.register_channel("/note", "cdr", text)
    shape = writer.register_schema("shape", "jsonschema", b"{}")
    json = writer.register_channel("/json", "json", shape)
    bare = writer.register_channel("/bare", "custom", 0)
    for time in reversed(range(1, 31)):
        writer.add_message(note, time, b"\0\1\0\0\2\0\0\0" + bytes([64 + time, 0]), time + 1000)
        writer.add_message(json, time, b'{"time": %d}' % time, time)
    writer.add_message(bare, 15, b"anything", 15)
    writer.finish()
"#;

#[test]
fn unordered_bags_with_unknown_topics_and_without_index_are_read() {
    let Some(python) = python() else { return };
    let scratch = tempfile::tempdir().unwrap();
    for compression in ["NONE", "ZSTD"] {
        let file = scratch.path().join(format!("{compression}.mcap"));
        let made = Command::new(&python)
            .args(["-c", UNUSUAL])
            .arg(&file)
            .arg(compression)
            .output()
            .unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        let bag = Bag::open(&file).unwrap();
        assert!(bag.report().is_whole(), "{:?}", bag.report().damage);
        let messages = all(&bag);
        assert_eq!(messages.len(), 61);
        assert!(messages.is_sorted_by_key(|message| message.log_time));
        let encodings: Vec<&str> = bag.topics().iter().map(|t| t.message_encoding.as_str()).collect();
        assert_eq!(encodings, ["cdr", "json", "custom"]);
        let note = messages.iter().find(|message| message.topic.name == "/note").unwrap();
        assert_eq!((note.log_time, note.publish_time, note.cdr[8]), (1, 1001, 65));
        copy_and_compare(&bag, &scratch.path().join(format!("{compression}_copy")));
    }
}

/// Whatever is read can be written again, types we do not know included.
fn copy_and_compare(bag: &Bag, folder: &Path) {
    let mut writer = BagWriter::create(folder).unwrap();
    for message in bag.messages() {
        let message = message.unwrap();
        let id = writer.add_topic_like(&message.topic).unwrap();
        let (log_time, publish_time) = (message.log_time, message.publish_time);
        writer
            .write_published(id, log_time, publish_time, &message.cdr)
            .unwrap();
    }
    writer.finish().unwrap();
    let copy = Bag::open(folder).unwrap();
    assert!(copy.report().is_whole(), "{:?}", copy.report().damage);
    let part = |m: RawMessage| {
        (
            m.topic.name.clone(),
            m.topic.message_encoding.clone(),
            m.publish_time,
            m.cdr,
        )
    };
    let [from, to] = [bag, &copy].map(|bag| all(bag).into_iter().map(part).collect::<Vec<_>>());
    assert_eq!(from, to);
}
