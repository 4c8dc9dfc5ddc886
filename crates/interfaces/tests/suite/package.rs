//! Our interface package as other ROS tools see it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn package() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../msgs/rakelight_msgs")
}

/// Lines without their comments.
fn declarations(path: &str) -> Vec<String> {
    let text = fs::read_to_string(package().join(path)).unwrap();
    let words = text
        .lines()
        .map(|line| line.split('#').next().unwrap().split_whitespace().collect::<Vec<_>>());
    words
        .filter(|words| !words.is_empty())
        .map(|words| words.join(" "))
        .collect()
}

#[test]
fn cmake_builds_every_interface_file() {
    let mut files = BTreeSet::new();
    for kind in ["msg", "srv", "action"] {
        for entry in fs::read_dir(package().join(kind)).unwrap() {
            files.insert(format!("{kind}/{}", entry.unwrap().file_name().into_string().unwrap()));
        }
    }
    let cmake = fs::read_to_string(package().join("CMakeLists.txt")).unwrap();
    let listed: BTreeSet<String> = cmake.split('"').skip(1).step_by(2).map(str::to_owned).collect();
    assert_eq!(listed, files);
}

/// Bags made elsewhere hold this message: neither order nor types may ever change.
#[test]
fn exposure_is_what_others_already_write() {
    assert_eq!(
        declarations("msg/Exposure.msg"),
        [
            "std_msgs/Header header",
            "string capture_id",
            "uint8 channel",
            "uint8 index",
            "uint8 count",
            "builtin_interfaces/Duration exposure_time",
            "float32 gain_db",
        ]
    );
}

/// ROS's own tools read less than our parser: they end a value at `#` even inside quotes, and do not know
/// `package/msg/Name`. Our package must mean the same to both.
#[test]
fn our_files_stay_within_what_every_ros_tool_reads() {
    for kind in ["msg", "srv", "action"] {
        for entry in fs::read_dir(package().join(kind)).unwrap() {
            let path = entry.unwrap().path();
            for line in fs::read_to_string(&path).unwrap().lines() {
                let code = line.split('#').next().unwrap();
                assert!(
                    !code.contains("/msg/") && !code.contains(['"', '\'']),
                    "{}: {line}",
                    path.display()
                );
            }
        }
    }
}
