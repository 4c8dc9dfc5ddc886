//! Byte-for-byte agreement with rosbags, an independent implementation of CDR and of the interface grammar.
//!
//! Needs a Python with the package `rosbags`: `RAKELIGHT_VENV_PYTHON`, or the one the set-up makes.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use interfaces::{Message, MessageVisitor, cdr};
use serde_json::{Value, json};

use crate::random::random_message;
use crate::visit_everything;

const SAMPLES_PER_TYPE: u64 = 8;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A Python that can import rosbags, or a loud word that there is none.
fn python() -> Option<PathBuf> {
    let named = std::env::var_os("RAKELIGHT_VENV_PYTHON").map(PathBuf::from);
    let is_named = named.is_some();
    let python = named.unwrap_or_else(|| repository().join(".setup/venv/bin/python"));
    let can_import = Command::new(&python)
        .args(["-c", "import rosbags"])
        .stderr(Stdio::null())
        .status();
    match can_import {
        Ok(status) if status.success() => Some(python),
        _ if is_named => panic!(
            "RAKELIGHT_VENV_PYTHON is {}, which cannot import rosbags",
            python.display()
        ),
        _ => {
            println!(
                "SKIPPED: no Python with rosbags at {}; run `cargo xtask setup`",
                python.display()
            );
            None
        }
    }
}

/// Every interface package and its folder.
fn packages() -> BTreeMap<String, PathBuf> {
    let parents = [
        "crates/interfaces/standard",
        "msgs",
        "crates/interface_generator/tests/packages",
    ];
    let folders = parents
        .iter()
        .flat_map(|parent| fs::read_dir(repository().join(parent)).unwrap());
    folders
        .map(|entry| entry.unwrap())
        .map(|e| (e.file_name().into_string().unwrap(), e.path()))
        .collect()
}

fn ask_rosbags(python: &Path, request: &Value) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rosbags_cdr.py");
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let request = request.to_string();
    let writer = std::thread::spawn(move || input.write_all(request.as_bytes()));
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "rosbags_cdr.py failed; its message is above");
    writer.join().unwrap().unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

fn to_hex(bytes: &[u8]) -> String {
    bytes
        .iter()
        .fold(String::new(), |hex, byte| hex + &format!("{byte:02x}"))
}

fn from_hex(text: &Value) -> Vec<u8> {
    let digits = text.as_str().unwrap().as_bytes().chunks(2);
    digits
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

struct Samples(Vec<Value>);

impl MessageVisitor for Samples {
    fn visit<M: Message>(&mut self) {
        for seed in 0..SAMPLES_PER_TYPE {
            let bytes = cdr::to_vec(&random_message::<M>(seed)).unwrap();
            self.0.push(json!({ "type": M::TYPE_NAME, "cdr": to_hex(&bytes) }));
        }
        let bytes = cdr::to_vec(&M::default()).unwrap();
        self.0.push(json!({ "type": M::TYPE_NAME, "cdr": to_hex(&bytes) }));
    }
}

/// Compares what rosbags wrote and read with our bytes and values, type by type.
struct Comparison {
    results: BTreeMap<String, Vec<Value>>,
    compared: usize,
}

impl Comparison {
    fn new(results: &Value) -> Self {
        let mut by_type: BTreeMap<String, Vec<Value>> = BTreeMap::new();
        for result in results.as_array().unwrap() {
            by_type
                .entry(result["type"].as_str().unwrap().to_owned())
                .or_default()
                .push(result.clone());
        }
        Self {
            results: by_type,
            compared: 0,
        }
    }
}

impl MessageVisitor for Comparison {
    fn visit<M: Message>(&mut self) {
        for theirs in self.results.remove(M::TYPE_NAME).unwrap_or_default() {
            let little = from_hex(&theirs["little"]);
            let message: M = cdr::from_slice(&little).unwrap();
            assert_eq!(cdr::to_vec(&message).unwrap(), little, "{}", M::TYPE_NAME);
            assert_eq!(
                cdr::from_slice::<M>(&from_hex(&theirs["big"])).unwrap(),
                message,
                "{}",
                M::TYPE_NAME
            );
            assert_same(&serde_json::to_value(&message).unwrap(), &theirs["value"], M::TYPE_NAME);
            self.compared += 1;
        }
    }
}

/// Equal JSON, but for the trailing `_` of names that are keywords here or there and the last bit of printed numbers.
fn assert_same(ours: &Value, theirs: &Value, place: &str) {
    match (ours, theirs) {
        (Value::Object(ours), Value::Object(theirs)) => {
            assert_eq!(ours.len(), theirs.len(), "{place}: {ours:?} and {theirs:?}");
            for (name, value) in ours {
                let name = name.trim_end_matches('_');
                assert_same(value, &theirs[name], &format!("{place}.{name}"));
            }
        }
        (Value::Array(ours), Value::Array(theirs)) => {
            assert_eq!(ours.len(), theirs.len(), "{place}");
            ours.iter()
                .zip(theirs)
                .for_each(|(ours, theirs)| assert_same(ours, theirs, place));
        }
        (Value::Number(our_number), Value::Number(_)) if our_number.is_f64() => {
            let (ours, theirs) = (ours.as_f64().unwrap(), theirs.as_f64().unwrap());
            assert!(
                (ours - theirs).abs() <= 1e-15 * ours.abs(),
                "{place}: {ours} and {theirs}"
            );
        }
        // ROS's `byte` is an octet, 0 to 255 (rclpy agrees); rosbags shows it as a signed number.
        (Value::Number(_), Value::Number(signed)) if signed.as_i64().is_some_and(|n| (-128..0).contains(&n)) => {
            let signed = signed.as_i64().unwrap_or_default();
            assert!(
                ours.as_i64().is_some_and(|ours| ours == signed || ours == signed + 256),
                "{place}: {ours}"
            );
        }
        _ => assert_eq!(ours, theirs, "{place}"),
    }
}

#[test]
fn every_type_has_the_bytes_and_values_of_rosbags() {
    let Some(python) = python() else { return };
    let mut samples = Samples(Vec::new());
    visit_everything(&mut samples);
    let reply = ask_rosbags(&python, &json!({ "packages": packages(), "samples": samples.0 }));
    for (ours, theirs) in samples.0.iter().zip(reply["results"].as_array().unwrap()) {
        assert_eq!(ours["cdr"], theirs["little"], "{}", ours["type"]);
    }
    let mut comparison = Comparison::new(&reply["results"]);
    visit_everything(&mut comparison);
    assert_eq!(comparison.compared, samples.0.len());
}

#[test]
fn standard_messages_are_those_that_rosbags_ships() {
    let Some(python) = python() else { return };
    let reply = ask_rosbags(&python, &json!({ "packages": packages(), "samples": [] }));
    let standard = reply["standard"].as_array().unwrap();
    assert!(standard.len() > 70, "only {} were compared", standard.len());
    for message in standard {
        assert_eq!(
            message["ours"]["digest"], message["theirs"]["digest"],
            "{}",
            message["type"]
        );
        assert_eq!(
            message["ours"]["constants"], message["theirs"]["constants"],
            "{}",
            message["type"]
        );
    }
    // What rosbags does not know is ours, a part of a service or action, or a package it lacks.
    for name in reply["missing"].as_array().unwrap() {
        let name = name.as_str().unwrap();
        let expected = ["rakelight_msgs/", "grammar_msgs/", "control_msgs/"]
            .iter()
            .any(|own| name.starts_with(own));
        assert!(expected || name.contains("/srv/"), "rosbags does not know {name}");
    }
}

#[test]
fn messages_of_another_writers_bag_are_read() {
    let bag = repository().join("../shared/data/bags/bag_mcap");
    if !bag.is_dir() {
        println!("SKIPPED: {} is missing", bag.display());
        return;
    }
    let Some(python) = python() else { return };
    let reply = ask_rosbags(&python, &json!({ "packages": {}, "samples": [], "bag": bag }));
    let mut comparison = Comparison::new(&reply["bag"]);
    let count = reply["bag"].as_array().unwrap().len();
    let types: Vec<String> = comparison.results.keys().cloned().collect();
    visit_everything(&mut comparison);
    assert_eq!(comparison.compared, count, "of the types {types:?}");
    for expected in [
        "sensor_msgs/msg/Image",
        "sensor_msgs/msg/CameraInfo",
        "sensor_msgs/msg/JointState",
    ] {
        assert!(
            types.iter().any(|name| name == expected),
            "the bag holds only {types:?}"
        );
    }
}
