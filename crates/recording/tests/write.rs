//! Bags of our own, read here and by other people's readers.

mod common;

use std::process::Command;

use common::{all, python, string_message, write_own};
use recording::{Bag, BagWriter, OfferedQos, RecordingError};

#[test]
fn what_is_written_is_read_in_the_order_of_time() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("own");
    let mut written = write_own(&folder);
    written.sort_by_key(|(time, ..)| *time);
    let bag = Bag::open(&folder).unwrap();
    assert!(bag.report().is_whole(), "{:?}", bag.report().damage);
    let read: Vec<_> = all(&bag)
        .into_iter()
        .map(|m| (m.log_time, m.topic.name.clone(), m.cdr.to_vec()))
        .collect();
    let written: Vec<_> = written
        .into_iter()
        .map(|(time, name, cdr)| (time, name.to_owned(), cdr))
        .collect();
    assert!(read == written, "messages differ");
    let packed = std::fs::metadata(folder.join("own.mcap")).unwrap().len();
    assert!(
        packed < 20 * 300_000 * 6 / 10,
        "{packed} bytes: sixteen letters need half a byte each"
    );
}

#[test]
fn an_unfinished_bag_is_read_and_named() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("own");
    write_own(&folder);
    std::fs::remove_file(folder.join("metadata.yaml")).unwrap();
    let bag = Bag::open(&folder).unwrap();
    assert_eq!(bag.report().messages, 60);
    assert!(bag.report().damage[0].reason.contains("metadata.yaml is missing"));
}

#[test]
fn nothing_is_overwritten_and_a_topic_keeps_its_type() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("own");
    let mut writer = BagWriter::create(&folder).unwrap();
    assert!(matches!(BagWriter::create(&folder), Err(RecordingError::Exists { .. })));
    let options = OfferedQos::default().into();
    let first = writer
        .add_topic("/a", "std_msgs/msg/String", "string data\n", &options)
        .unwrap();
    assert_eq!(
        first,
        writer
            .add_topic("/a", "std_msgs/msg/String", "string data\n", &options)
            .unwrap()
    );
    let error = writer.add_topic("/a", "std_msgs/msg/Empty", "", &options).unwrap_err();
    assert_eq!(
        error.to_string(),
        "topic /a was added as std_msgs/msg/String, now as std_msgs/msg/Empty"
    );
    writer.write(first, 5, &string_message(b"x")).unwrap();
    writer.finish().unwrap();
    let empty = scratch.path().join("empty");
    BagWriter::create(&empty).unwrap().finish().unwrap();
    let bag = Bag::open(&empty).unwrap();
    assert!(bag.report().is_whole() && bag.report().messages == 0 && bag.report().span.is_none());
}

#[test]
fn rosbags_and_mcap_read_our_bags() {
    let Some(python) = python() else { return };
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("own");
    let written = write_own(&folder);
    let output = Command::new(python)
        .arg("-c")
        .arg(READ_BACK)
        .arg(&folder)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let sum: u64 = written
        .iter()
        .map(|(_, _, cdr)| cdr.iter().map(|&byte| u64::from(byte)).sum::<u64>())
        .sum();
    let expected = format!("ros2 zstd 60 60 {sum} {sum} transient_local /blob,/note\n");
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected, "{errors}");
}

const READ_BACK: &str = r#"
import pathlib, sys
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
folder = pathlib.Path(sys.argv[1])
with Reader(folder) as bag:
    rosbags = [bytes(data) for _, _, data in bag.messages()]
    counts = {c.topic: c.msgcount for c in bag.connections}
    qos = {c.topic: c.ext.offered_qos_profiles for c in bag.connections}
with open(folder / "own.mcap", "rb") as stream:
    reader = make_reader(stream, validate_crcs=True)
    mcap = [message.data for _, _, message in reader.iter_messages()]
    chunks = {chunk.compression for chunk in reader.get_summary().chunk_indexes}
    profile = reader.get_header().profile
assert counts == {"/blob": 20, "/note": 40}, counts
durability = qos["/blob"][0].durability.name.lower()
print(profile, *chunks, len(rosbags), len(mcap), sum(map(sum, rosbags)), sum(map(sum, mcap)), durability,
      ",".join(sorted(counts)))
"#;
