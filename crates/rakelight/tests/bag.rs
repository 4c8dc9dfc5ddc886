//! `rakelight bag info|check|cut` as a person and a script use it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::{CellState, Exposure};
use interfaces::sensor_msgs::msg::{CameraInfo, Image, JointState};
use interfaces::tf2_msgs::msg::TFMessage;
use interfaces::{Message, cdr};
use recording::{Bag, BagWriter, OfferedQos, TopicId};
use tempfile::TempDir;

const SECOND: u64 = 1_000_000_000;
const START: u64 = 1_700_000_000 * SECOND;

/// A bag of two captures, one second apart, whose parts can be left out or spoilt.
struct Session {
    bag: BagWriter,
    folder: TempDir,
}

impl Session {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let bag = BagWriter::create(folder.path().join("session")).unwrap();
        Self { bag, folder }
    }

    fn topic<M: Message>(&mut self, name: &str, transient_local: bool) -> TopicId {
        let qos = OfferedQos {
            transient_local,
            ..OfferedQos::default()
        };
        self.bag
            .add_topic(name, M::TYPE_NAME, M::DEFINITION, &qos.into())
            .unwrap()
    }

    fn put<M: Message>(&mut self, name: &str, latched: bool, at: u64, message: &M) {
        let topic = self.topic::<M>(name, latched);
        self.bag.write(topic, at, &cdr::to_vec(message).unwrap()).unwrap();
    }

    /// One image of a capture and its exposure; `None` leaves it out.
    fn frame(&mut self, capture: u64, camera: &str, index: u8, image_delay: Option<i64>, exposed: bool) {
        let at = START + capture * SECOND + u64::from(index) * 15_000_000;
        let stamp = |delay: i64| Time::from_nanos(at as i64 + delay).unwrap();
        let mut exposure = Exposure {
            capture_id: format!("capture_{capture}"),
            channel: index,
            index,
            count: 8,
            ..Exposure::default()
        };
        exposure.header.stamp = stamp(0);
        if let Some(delay) = image_delay {
            let mut image = Image {
                width: 4,
                height: 2,
                step: 8,
                encoding: "mono16".into(),
                data: vec![index; 16].into(),
                ..Image::default()
            };
            image.header.stamp = stamp(delay);
            self.put(&format!("/cell/{camera}/image_raw"), false, at + 1000, &image);
        }
        if exposed {
            self.put(&format!("/cell/{camera}/exposure"), false, at + 2000, &exposure);
        }
    }

    fn capture(&mut self, capture: u64) {
        for index in 0..8 {
            self.frame(capture, "c1", index, Some(0), true);
            self.frame(capture, "c2", index, Some(0), true);
        }
    }

    /// What is there before the captures.
    fn beginning(&mut self) {
        for camera in ["c1", "c2"] {
            self.put(
                &format!("/cell/{camera}/camera_info"),
                true,
                START - 2 * SECOND,
                &CameraInfo::default(),
            );
        }
        self.put("/tf_static", true, START - 2 * SECOND, &TFMessage::default());
        self.put("/tf_static", true, START - 19 * SECOND / 10, &TFMessage::default());
        let state = |stage| CellState {
            stage,
            ..CellState::default()
        };
        self.put("/cell/state", true, START - 2 * SECOND, &state(CellState::STARTING));
        self.put("/cell/state", true, START - SECOND, &state(CellState::IDLE));
        for step in 0..40 {
            self.put(
                "/cell/joint_states",
                false,
                START + step * SECOND / 10,
                &JointState::default(),
            );
        }
    }

    fn finish(self) -> TempDir {
        self.bag.finish().unwrap();
        self.folder
    }
}

fn good() -> TempDir {
    let mut session = Session::new();
    session.beginning();
    session.capture(1);
    session.capture(2);
    session.finish()
}

fn rakelight(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rakelight"))
        .arg("bag")
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Exit code, standard output and standard error, as one text.
fn told(folder: &Path, arguments: &[&str]) -> String {
    let output = rakelight(folder, arguments);
    let (out, err) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    let code = output.status.code().unwrap();
    format!(
        "$ rakelight bag {}\n{out}--- stderr\n{err}--- exit code {code}\n",
        arguments.join(" ")
    )
}

fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = rakelight(folder, arguments);
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_good_bag() {
    let folder = good();
    insta::assert_snapshot!("info", told(folder.path(), &["info", "session"]));
    insta::assert_snapshot!("check_good", told(folder.path(), &["check", "session"]));
    let info = json(folder.path(), &["info", "session", "--json"]);
    assert_eq!(info["captures"][1]["id"], "capture_2");
    assert_eq!(info["captures"][1]["cameras"][0]["exposures"][3]["light"], "L3");
    assert_eq!(
        (info["messages"].as_u64(), info["damage"].as_array().map(Vec::len)),
        (Some(110), Some(0))
    );
    let check = json(folder.path(), &["check", "session", "--json"]);
    assert_eq!(
        (check["captures"].as_u64(), check["problems"].as_array().map(Vec::len)),
        (Some(2), Some(0))
    );
}

#[test]
fn every_kind_of_problem_is_named() {
    let mut session = Session::new();
    session.put("/cell/c2/camera_info", true, START, &CameraInfo::default());
    for index in 0..8 {
        // Of c1's images, one is missing, one has another stamp, and one exposure is missing.
        let delay = match index {
            2 => None,
            4 => Some(-90_000_000),
            _ => Some(0),
        };
        session.frame(1, "c1", index, delay, index != 6);
        session.frame(1, "c2", index, Some(0), true);
    }
    session.frame(1, "c2", 7, None, true);
    session.frame(1, "c2", 9, None, true);
    let joints = session.topic::<JointState>("/cell/joint_states", false);
    session.bag.write(joints, START, b"\0\x01\0\0short").unwrap();
    let odd = session
        .bag
        .add_topic("/odd", "odd_msgs/msg/Odd", "int8 x\n", &OfferedQos::default().into())
        .unwrap();
    session.bag.write(odd, START, b"\0\x01\0\0\x05").unwrap();
    let folder = session.finish();
    insta::assert_snapshot!("check_problems", told(folder.path(), &["check", "session"]));
    insta::assert_snapshot!("info_problems", told(folder.path(), &["info", "session"]));
    let check = json(folder.path(), &["check", "session", "--json"]);
    let kinds: Vec<&str> = check["problems"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["kind"].as_str().unwrap())
        .collect();
    for kind in [
        "undecodable",
        "capture_incomplete",
        "exposure_without_image",
        "image_without_exposure",
        "stamps_out_of_order",
        "no_calibration",
    ] {
        assert!(kinds.contains(&kind), "{kind}: {kinds:?}");
    }
}

#[test]
fn damage_is_named_with_file_and_byte() {
    let folder = good();
    let file = folder.path().join("session/session.mcap");
    let content = std::fs::read(&file).unwrap();
    std::fs::write(&file, &content[..2000]).unwrap();
    std::fs::remove_file(folder.path().join("session/metadata.yaml")).unwrap();
    insta::assert_snapshot!("check_damaged", told(folder.path(), &["check", "session"]));
    let check = json(folder.path(), &["check", "session", "--json"]);
    let cut_off = &check["problems"][1];
    assert_eq!(
        (cut_off["kind"].as_str(), cut_off["file"].as_str()),
        (Some("damage"), Some("session/session.mcap"))
    );
    assert!(cut_off["byte"].as_u64().unwrap() < 2000);
    let info = json(folder.path(), &["info", "session", "--json"]);
    assert_eq!(info["damage"].as_array().unwrap().len(), 2);
}

/// Topic, log time and content of every message.
fn contents(bag: &Path) -> Vec<(String, u64, Vec<u8>)> {
    let bag = Bag::open(bag).unwrap();
    assert!(bag.report().is_whole(), "{:?}", bag.report().damage);
    let message = |message: Result<recording::RawMessage, _>| {
        let message = message.unwrap();
        (message.topic.name.clone(), message.log_time, message.cdr.to_vec())
    };
    bag.messages().map(message).collect()
}

fn count(messages: &[(String, u64, Vec<u8>)], topic: &str) -> usize {
    messages.iter().filter(|(name, ..)| name == topic).count()
}

#[test]
fn a_cut_in_time_keeps_what_was_latched_before() {
    let folder = good();
    let arguments = ["cut", "session", "-o", "part", "--from", "3.95", "--to", "5"];
    insta::assert_snapshot!("cut_in_time", told(folder.path(), &arguments));
    let part = contents(&folder.path().join("part"));
    // The bag begins two seconds before START, so the part begins with the second capture's index 0 less 50 ms.
    let from = START + 1_950_000_000;
    assert!(
        part.iter()
            .all(|(_, time, _)| (from..=START + 3 * SECOND).contains(time))
    );
    assert_eq!(
        (
            count(&part, "/tf_static"),
            count(&part, "/cell/c1/camera_info"),
            count(&part, "/cell/state")
        ),
        (2, 1, 1)
    );
    assert_eq!(
        (count(&part, "/cell/c1/image_raw"), count(&part, "/cell/joint_states")),
        (8, 11)
    );
    let (_, _, state) = part.iter().find(|(name, ..)| name == "/cell/state").unwrap();
    assert_eq!(
        cdr::from_slice::<CellState>(state).unwrap().stage,
        CellState::IDLE,
        "the last one before the cut"
    );
    assert_eq!(rakelight(folder.path(), &["check", "part"]).status.code(), Some(0));
    let original = Bag::open(folder.path().join("session")).unwrap();
    let cut = Bag::open(folder.path().join("part")).unwrap();
    for topic in cut.topics() {
        let same = |known: &&std::sync::Arc<recording::Topic>| known.name == topic.name;
        let known = original.topics().iter().find(same).unwrap();
        assert_eq!((&known.definition, &known.options), (&topic.definition, &topic.options));
    }
}

#[test]
fn a_cut_by_capture_keeps_its_images_and_what_lies_around() {
    let folder = good();
    for (name, out) in [("2", "by_number"), ("capture_2", "by_id")] {
        let report = json(
            folder.path(),
            &["cut", "session", "-o", out, "--json", "--capture", name],
        );
        assert_eq!(
            (report["latched"].as_u64(), report["damage"].as_array().map(Vec::len)),
            (Some(5), Some(0)),
            "{report}"
        );
    }
    let part = contents(&folder.path().join("by_number"));
    assert_eq!(part, contents(&folder.path().join("by_id")));
    for topic in ["/cell/c1/image_raw", "/cell/c2/image_raw", "/cell/c1/exposure"] {
        assert_eq!(count(&part, topic), 8, "{topic}");
    }
    assert_eq!(count(&part, "/cell/joint_states"), 21, "a second before and after");
    let check = json(folder.path(), &["check", "by_id", "--json"]);
    assert_eq!(
        (check["captures"].as_u64(), check["problems"].as_array().map(Vec::len)),
        (Some(1), Some(0))
    );
}

#[test]
fn a_cut_by_topic_has_no_other() {
    let folder = good();
    let arguments = [
        "cut",
        "session",
        "-o",
        "part",
        "--topics",
        "/cell/joint_states",
        "/cell/state",
    ];
    assert_eq!(rakelight(folder.path(), &arguments).status.code(), Some(0));
    let part = contents(&folder.path().join("part"));
    assert_eq!(
        (
            count(&part, "/cell/joint_states"),
            count(&part, "/cell/state"),
            part.len()
        ),
        (40, 2, 42)
    );
    assert_eq!(Bag::open(folder.path().join("part")).unwrap().topics().len(), 2);
}

#[test]
fn bad_usage_is_refused_and_makes_nothing() {
    let folder = good();
    std::fs::create_dir(folder.path().join("there")).unwrap();
    std::fs::write(folder.path().join("text.mcap"), "no bag at all").unwrap();
    let refusals: [&[&str]; 9] = [
        &["info", "nowhere"],
        &["check", "text.mcap"],
        &["info", "there"],
        &["cut", "session", "-o", "there"],
        &["cut", "session", "-o", "out", "--capture", "7"],
        &["cut", "session", "-o", "out", "--topics", "/cell/state", "/nobody"],
        &["cut", "session", "-o", "out", "--from", "99"],
        &["cut", "session", "-o", "out", "--from", "0.001", "--to", "0.002"],
        &["cut", "session", "-o", "out", "--to", "-1"],
    ];
    let texts: Vec<String> = refusals
        .iter()
        .map(|arguments| told(folder.path(), arguments))
        .collect();
    insta::assert_snapshot!("refusals", texts.join("\n"));
    assert!(!folder.path().join("out").exists());
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn a_bag_of_path_traced_captures_by_another_writer_is_in_order() {
    let shared = root().join("../shared");
    let (tool, scenes) = (
        shared.join("tools/scene_to_bag.py"),
        shared.join("data/rig/calibration"),
    );
    if !tool.exists() || !scenes.exists() {
        println!("SKIPPED: no {} or {}", tool.display(), scenes.display());
        return;
    }
    let named = std::env::var_os("RAKELIGHT_VENV_PYTHON").map(PathBuf::from);
    let python = named.unwrap_or_else(|| root().join(".setup/venv/bin/python"));
    if !Command::new(&python)
        .args(["-c", "import cv2, rosbags"])
        .output()
        .is_ok_and(|probe| probe.status.success())
    {
        println!(
            "SKIPPED: {} has no cv2 and rosbags (cargo xtask setup)",
            python.display()
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let made = Command::new(python)
        .arg(&tool)
        .arg("--msgs")
        .arg(root().join("msgs/rakelight_msgs"))
        .arg(folder.path().join("traced"))
        .args(["hemi00", "hemi02"].map(|scene| scenes.join(scene)))
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let check = told(folder.path(), &["check", "traced"]);
    assert!(
        check.contains("2 captures\neverything is in order\n") && check.ends_with("exit code 0\n"),
        "{check}"
    );
    let cut = json(
        folder.path(),
        &["cut", "traced", "-o", "one", "--capture", "1", "--json"],
    );
    assert_eq!(cut["damage"].as_array().map(Vec::len), Some(0));
    let info = json(folder.path(), &["info", "one", "--json"]);
    let captures = info["captures"].as_array().unwrap();
    assert_eq!(
        (captures.len(), captures[0]["cameras"].as_array().map(Vec::len)),
        (1, Some(2))
    );
    let check = told(folder.path(), &["check", "one"]);
    assert!(check.contains("everything is in order"), "{check}");
}
