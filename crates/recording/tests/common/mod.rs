//! Bags made by other writers, and where to find them.
#![allow(dead_code, reason = "each test file uses its part")]

use std::path::{Path, PathBuf};
use std::process::Command;

use recording::{Bag, BagWriter, OfferedQos, RawMessage};

/// The project's root.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A folder beside the project; says loudly when it is missing.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let folder = root().join("../shared").join(path);
    if folder.exists() {
        return Some(folder);
    }
    println!("SKIPPED: {} is missing", folder.display());
    None
}

/// A Python with `rosbags` and `mcap`: the one named by the environment or the one the set-up made.
pub(crate) fn python() -> Option<PathBuf> {
    let named = std::env::var_os("RAKELIGHT_VENV_PYTHON").map(PathBuf::from);
    let python = named.unwrap_or_else(|| root().join(".setup/venv/bin/python"));
    let probe = Command::new(&python)
        .args(["-c", "import rosbags.rosbag2, mcap.reader"])
        .output();
    if probe.is_ok_and(|probe| probe.status.success()) {
        return Some(python);
    }
    println!(
        "SKIPPED: {} has no rosbags and mcap (cargo xtask setup)",
        python.display()
    );
    None
}

pub(crate) fn all(bag: &Bag) -> Vec<RawMessage> {
    bag.messages()
        .map(|message| message.expect("a message of the index can be read"))
        .collect()
}

/// A bag of our own: messages of several sizes on two topics, written out of order.
pub(crate) fn write_own(folder: &Path) -> Vec<(u64, &'static str, Vec<u8>)> {
    let mut random = fastrand::Rng::with_seed(7);
    let mut writer = BagWriter::create(folder).unwrap();
    let latched = OfferedQos {
        transient_local: true,
        depth: 1,
        ..OfferedQos::default()
    };
    let note = writer
        .add_topic(
            "/note",
            "std_msgs/msg/String",
            "string data\n",
            &OfferedQos::default().into(),
        )
        .unwrap();
    let blob = writer
        .add_topic("/blob", "std_msgs/msg/String", "string data\n", &latched.into())
        .unwrap();
    let mut written = Vec::new();
    for step in 0..60_u64 {
        let (id, name, length) = if step % 3 == 0 {
            (blob, "/blob", 300_000)
        } else {
            (note, "/note", 40)
        };
        let text: Vec<u8> = (0..length).map(|_| random.u8(b'a'..=b'p')).collect();
        let cdr = string_message(&text);
        // Every second message comes late.
        let time = 1_700_000_000_000_000_000 + if step % 2 == 0 { step } else { step - 1 } * 1_000_000;
        writer.write(id, time, &cdr).unwrap();
        written.push((time, name, cdr));
    }
    writer.finish().unwrap();
    written
}

/// A `std_msgs/msg/String` in little-endian CDR.
pub(crate) fn string_message(text: &[u8]) -> Vec<u8> {
    let length = (text.len() as u32 + 1).to_le_bytes();
    [&[0, 1, 0, 0], length.as_slice(), text, &[0]].concat()
}
