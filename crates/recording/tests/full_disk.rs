//! Disks that refuse: really full ones, and files that may not grow. What is on them stays readable, for everybody.

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::python;

/// The example `02_fill_disk`, which cargo builds together with this test.
fn fill_disk() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().and_then(Path::parent).unwrap();
    let example = folder.join("examples/02_fill_disk");
    assert!(example.exists(), "{} is built with the tests", example.display());
    example
}

fn shell(script: &str, bag: &Path) -> Output {
    let fill = fill_disk();
    let shell = Command::new("sh")
        .args(["-c", script, "sh"])
        .args([fill.as_path(), bag])
        .output()
        .unwrap();
    println!(
        "{}{}",
        String::from_utf8_lossy(&shell.stdout),
        String::from_utf8_lossy(&shell.stderr)
    );
    shell
}

/// The value that the example gave for `key`.
fn told<'a>(output: &'a str, key: &str) -> &'a str {
    let line = output
        .lines()
        .find_map(|line| line.strip_prefix(key)?.strip_prefix(": "));
    line.unwrap_or_else(|| panic!("no {key} in {output}"))
}

/// Part of the messages are there, and nothing is damaged.
fn check(output: &Output, reason: &str) {
    assert!(output.status.success());
    let output = String::from_utf8_lossy(&output.stdout);
    assert_eq!(told(&output, "told"), "true");
    assert!(told(&output, "failure").contains(reason), "{output}");
    let read: usize = told(&output, "read").parse().unwrap();
    assert!(
        read > 0 && told(&output, "safe").starts_with(&format!("{read}, ")),
        "{output}"
    );
    assert!(told(&output, "lost").parse::<usize>().unwrap() > 0);
    assert!(!output.contains("damage:"), "{output}");
}

#[test]
fn a_file_that_may_not_grow_ends_readable_for_everybody() {
    let scratch = tempfile::tempdir().unwrap();
    let bag = scratch.path().join("bag");
    // 1 kB blocks in some shells, 512 B in others; too large a file gives an error instead of a signal.
    let output = shell(r#"trap "" XFSZ; ulimit -f 12000; exec "$1" "$2" 20"#, &bag);
    check(&output, "File too large");
    let Some(python) = python() else { return };
    let read_back = Command::new(python)
        .arg("-c")
        .arg(READ_BACK)
        .arg(&bag)
        .output()
        .unwrap();
    assert!(
        read_back.status.success(),
        "{}",
        String::from_utf8_lossy(&read_back.stderr)
    );
    let output = String::from_utf8_lossy(&output.stdout);
    let read = told(&output, "read");
    assert_eq!(String::from_utf8_lossy(&read_back.stdout), format!("{read} {read}\n"));
}

#[test]
fn a_full_disk_ends_the_bag_readable() {
    let scratch = tempfile::tempdir().unwrap();
    // A small disk that only this process sees and that goes with it.
    let mounted = Command::new("unshare")
        .args(["-m", "mount", "-t", "tmpfs", "none"])
        .arg(scratch.path())
        .output();
    if !mounted.as_ref().is_ok_and(|mounted| mounted.status.success()) {
        println!("SKIPPED: this user may not mount a small disk: {mounted:?} (run as root)");
        return;
    }
    let bag = scratch.path().join("disk/bag");
    std::fs::create_dir(scratch.path().join("disk")).unwrap();
    let output = shell(
        r#"exec unshare -m sh -c 'mount -t tmpfs -o size=8m none "$(dirname "$2")" && exec "$1" "$2" 20' sh "$1" "$2""#,
        &bag,
    );
    check(&output, "No space left on device");
}

#[test]
fn a_disk_that_does_not_fill_keeps_everything() {
    let scratch = tempfile::tempdir().unwrap();
    let output = shell(r#"exec "$1" "$2" 6"#, &scratch.path().join("bag"));
    let output = String::from_utf8_lossy(&output.stdout);
    assert_eq!(
        (told(&output, "told"), told(&output, "failure"), told(&output, "lost")),
        ("false", "", "0")
    );
    assert_eq!(told(&output, "read"), "20");
}

const READ_BACK: &str = r#"
import pathlib, sys
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
folder = pathlib.Path(sys.argv[1])
with Reader(folder) as bag:
    rosbags = sum(1 for _ in bag.messages())
    assert bag.message_count == rosbags, bag.message_count
with open(folder / "bag.mcap", "rb") as stream:
    print(rosbags, sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages()))
"#;
