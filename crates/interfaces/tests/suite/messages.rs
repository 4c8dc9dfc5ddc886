//! What written types promise: defaults, constants, bounds, byte sequences, times, definitions, errors.

#![allow(
    clippy::float_cmp,
    reason = "defaults and constants are the files' numbers, to the last bit"
)]

use std::collections::BTreeSet;
use std::time::Duration as StdDuration;

use interfaces::builtin_interfaces::msg::{Duration, Time};
use interfaces::diagnostic_msgs::msg::DiagnosticStatus;
use interfaces::geometry_msgs::msg::{Quaternion, TransformStamped};
use interfaces::rakelight_msgs::{action, msg, srv};
use interfaces::rcl_interfaces::msg::{FloatingPointRange, ParameterDescriptor};
use interfaces::sensor_msgs::msg::Image;
use interfaces::std_srvs::srv::{Trigger, TriggerRequest};
use interfaces::trajectory_msgs::msg::JointTrajectoryPoint;
use interfaces::{Action, ByteSequence, Message, MessageVisitor, Service, cdr};

use crate::grammar_msgs::action::{WalkGoal, WalkResult};
use crate::grammar_msgs::msg::{Bounds, Constants, Defaults, Empty, Names};
use crate::grammar_msgs::srv::{AskRequest, AskResponse};

#[test]
fn defaults_are_the_files() {
    let defaults = Defaults::default();
    assert!(defaults.flag);
    assert_eq!(
        (defaults.raw, defaults.letter, defaults.low, defaults.high),
        (7, 122, -128, u64::MAX)
    );
    assert_eq!((defaults.single, defaults.double, defaults.whole), (-1.5, 1000.0, 2.0));
    assert_eq!(defaults.bare, "hello");
    assert_eq!(defaults.double_quoted, "with spaces, # and \"quotes\"");
    assert_eq!(
        (defaults.single_quoted.as_str(), defaults.short.as_str()),
        ("it's", "abcde")
    );
    assert_eq!(
        (defaults.unbounded, defaults.no_elements, defaults.bounded),
        (vec![1, -2, 3], vec![], vec![7, 8])
    );
    assert_eq!(
        (defaults.fixed, defaults.two_bytes, defaults.flags),
        ([4, 5, 6], [3, 4], [true, false])
    );
    assert_eq!(*defaults.bytes, [1, 2, 255]);
    assert_eq!(defaults.identity, [1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    assert_eq!(defaults.words, ["one", "two, three", "four"]);
    assert_eq!(defaults.two_words, ["five", "six"]);
    let identity = Quaternion {
        x: 0.0,
        y: 0.0,
        z: 0.0,
        w: 1.0,
    };
    assert_eq!(TransformStamped::default().transform.rotation, identity);
}

#[test]
fn constants_are_the_files() {
    assert_eq!((Constants::YES, Constants::NO), (true, false));
    assert_eq!((Constants::RAW, Constants::LETTER, Constants::HIGH), (255, 65, 255));
    assert_eq!(
        (Constants::SINGLE, Constants::DOUBLE, Constants::TINY),
        (0.1_f32, -1e-300, -0.5)
    );
    assert_eq!(
        (Constants::LOW, Constants::I16, Constants::I32, Constants::I64),
        (-128, i16::MIN, i32::MIN, i64::MIN)
    );
    assert_eq!(
        (Constants::U16, Constants::U32, Constants::U64),
        (u16::MAX, u32::MAX, u64::MAX)
    );
    assert_eq!((Constants::BARE, Constants::EMPTY), ("plain text", ""));
    assert_eq!(
        (Constants::QUOTED, Constants::SINGLE_QUOTED),
        ("a # is text here", "it's \"quoted\"")
    );
    assert_eq!(DiagnosticStatus::WARN, 1);
}

#[test]
fn keywords_and_type_names_of_every_form_work() {
    let names = Names {
        type_: 1,
        ref_: "r".into(),
        match_: true,
        self_: 2,
        async_: 3.0,
        ..Names::default()
    };
    assert_eq!(cdr::from_slice::<Names>(&cdr::to_vec(&names).unwrap()).unwrap(), names);
    let _: [&interfaces::std_msgs::msg::Header; 3] = [&names.header, &names.full_header, &names.fuller_header];
}

/// The fields of `Bounds` without their bounds: the same bytes.
type Unbounded = (
    String,
    Vec<String>,
    [String; 2],
    Vec<String>,
    Vec<i32>,
    ByteSequence,
    Vec<String>,
    Vec<Empty>,
);

/// Checks that `change` makes a message that can be neither written, nor read when another writer made it.
fn assert_refused(change: impl FnOnce(&mut Bounds), expected: &str) {
    let mut b = Bounds::default();
    change(&mut b);
    let expected = format!("grammar_msgs/msg/Bounds: field {expected}");

    let written = cdr::to_vec(&b).unwrap_err().to_string();
    assert!(
        written.starts_with("cannot serialise") && written.ends_with(&expected),
        "{written}"
    );

    let unbounded: Unbounded = (
        b.text,
        b.texts,
        b.two_texts,
        b.few_texts,
        b.numbers,
        b.bytes,
        b.words,
        b.empties,
    );
    let bytes = [&cdr::LITTLE_ENDIAN_HEADER, cdr::to_body(&unbounded).unwrap().as_slice()].concat();
    let read = cdr::from_slice::<Bounds>(&bytes).unwrap_err().to_string();
    assert!(
        read.starts_with("cannot deserialise") && read.ends_with(&expected),
        "{read}"
    );
}

#[test]
fn bounded_text_is_refused_both_ways_by_name() {
    let long = || "abcde".to_owned();
    assert_refused(|b| b.text = long(), "`text` has 5 bytes of text; allowed: at most 4");
    assert_refused(
        |b| b.text = "ééé".into(),
        "`text` has 6 bytes of text; allowed: at most 4",
    );
    assert_refused(
        |b| b.texts = vec![String::new(), long()],
        "`texts` has 5 bytes of text; allowed: at most 4",
    );
    assert_refused(
        |b| b.two_texts[1] = long(),
        "`two_texts` has 5 bytes of text; allowed: at most 4",
    );
    assert_refused(
        |b| b.few_texts = vec![long()],
        "`few_texts` has 5 bytes of text; allowed: at most 4",
    );
}

#[test]
fn bounded_sequences_are_refused_both_ways_by_name() {
    let words = |count: usize| vec!["ab".to_owned(); count];
    assert_refused(
        |b| b.few_texts = words(4),
        "`few_texts` has 4 elements; allowed: at most 3",
    );
    assert_refused(
        |b| b.numbers = vec![0; 4],
        "`numbers` has 4 elements; allowed: at most 3",
    );
    assert_refused(
        |b| b.bytes = vec![0; 9].into(),
        "`bytes` has 9 elements; allowed: at most 3",
    );
    assert_refused(|b| b.words = words(3), "`words` has 3 elements; allowed: at most 2");
    assert_refused(
        |b| b.empties = vec![Empty::default(); 3],
        "`empties` has 3 elements; allowed: at most 2",
    );
    let range = FloatingPointRange {
        from_value: 0.0,
        to_value: 1.0,
        step: 0.0,
    };
    let descriptor = ParameterDescriptor {
        floating_point_range: vec![range; 2],
        ..ParameterDescriptor::default()
    };
    let refused = cdr::to_vec(&descriptor).unwrap_err().to_string();
    assert!(
        refused.contains("`floating_point_range` has 2 elements; allowed: at most 1"),
        "{refused}"
    );
}

#[test]
fn what_just_fits_its_bounds_is_kept() {
    let words = || vec!["ab".to_owned(); 2];
    let full = Bounds {
        text: "abcd".into(),
        two_texts: ["abcd".into(), String::new()],
        numbers: vec![1, 2, 3],
        words: words(),
        few_texts: words(),
        bytes: vec![1, 2, 3].into(),
        ..Bounds::default()
    };
    assert_eq!(cdr::from_slice::<Bounds>(&cdr::to_vec(&full).unwrap()).unwrap(), full);
}

#[test]
fn parts_of_services_and_actions_have_constants_and_defaults() {
    assert_eq!((AskRequest::KIND_SHORT, WalkResult::STUCK), (1, -1));
    assert_eq!(
        (AskResponse::default().answer.as_str(), WalkGoal::default().speed),
        ("none", 0.5)
    );
    let path = vec![interfaces::geometry_msgs::msg::Point::default(); 4];
    let refused = cdr::to_vec(&WalkGoal {
        path,
        ..WalkGoal::default()
    })
    .unwrap_err()
    .to_string();
    let expected = "grammar_msgs/action/Walk_Goal: field `path` has 4 elements; allowed: at most 3";
    assert!(refused.ends_with(expected), "{refused}");
}

#[test]
fn empty_messages_have_their_one_byte() {
    assert_eq!(cdr::to_vec(&TriggerRequest::default()).unwrap(), [0, 1, 0, 0, 0]);
    assert_eq!(cdr::to_vec(&Empty::default()).unwrap(), [0, 1, 0, 0, 0]);
}

#[test]
fn byte_sequences_are_shared_not_copied() {
    struct Floats(Vec<[u8; 4]>);
    impl AsRef<[u8]> for Floats {
        fn as_ref(&self) -> &[u8] {
            self.0.as_flattened()
        }
    }
    let floats = Floats(vec![1.0_f32.to_le_bytes(), 2.0_f32.to_le_bytes()]);
    let address = floats.as_ref().as_ptr();
    let bytes = ByteSequence::from_owner(floats);
    let image = Image {
        data: bytes,
        ..Image::default()
    };
    let copy = image.clone();
    assert_eq!((image.data.as_ptr(), copy.data.as_ptr()), (address, address));
    let vector = vec![9_u8; 100];
    let address = vector.as_ptr();
    assert_eq!(ByteSequence::from(vector).as_ptr(), address);
    assert_eq!(
        format!("{:?}", ByteSequence::from(vec![1, 2])),
        "ByteSequence(2 bytes: [01, 02])"
    );
    assert!(format!("{:?}", ByteSequence::from(vec![0; 1000])).len() < 120);
}

#[test]
fn times_convert_to_nanoseconds_and_back() {
    for nanoseconds in [
        0,
        1,
        -1,
        999_999_999,
        1_000_000_000,
        -1_000_000_001,
        1_700_000_000_123_456_789,
    ] {
        assert_eq!(Time::from_nanos(nanoseconds).unwrap().to_nanos(), nanoseconds);
        assert_eq!(Duration::from_nanos(nanoseconds).unwrap().to_nanos(), nanoseconds);
    }
    assert_eq!(
        Duration::from_nanos(-1).unwrap(),
        Duration {
            sec: -1,
            nanosec: 999_999_999
        }
    );
    assert_eq!(
        Time::from_nanos(i64::MAX).unwrap_err().to_string(),
        "9223372036 s do not fit; allowed: from -2147483648 s to 2147483647 s"
    );
    let exposure = StdDuration::from_micros(2500);
    assert_eq!(
        Duration::try_from(exposure).unwrap(),
        Duration {
            sec: 0,
            nanosec: 2_500_000
        }
    );
    assert_eq!(
        StdDuration::try_from(Duration {
            sec: 0,
            nanosec: 2_500_000
        })
        .unwrap(),
        exposure
    );
    assert!(StdDuration::try_from(Duration { sec: -1, nanosec: 5 }).is_err());
    assert!(Duration::try_from(StdDuration::from_secs(1 << 31)).is_err());
}

#[test]
fn names_are_those_of_ros() {
    assert_eq!(<Trigger as Service>::TYPE_NAME, "std_srvs/srv/Trigger");
    assert_eq!(TriggerRequest::TYPE_NAME, "std_srvs/srv/Trigger_Request");
    assert_eq!(
        <srv::Capture as Service>::Response::TYPE_NAME,
        "rakelight_msgs/srv/Capture_Response"
    );
    assert_eq!(
        <action::PickCycle as Action>::TYPE_NAME,
        "rakelight_msgs/action/PickCycle"
    );
    assert_eq!(
        <action::PickCycle as Action>::Feedback::TYPE_NAME,
        "rakelight_msgs/action/PickCycle_Feedback"
    );
}

#[test]
fn definitions_carry_every_dependency_once() {
    let separator = "=".repeat(80);
    let parts: Vec<&str> = Image::DEFINITION.split(&format!("{separator}\nMSG: ")).collect();
    let heads: Vec<&str> = parts[1..].iter().map(|part| part.lines().next().unwrap()).collect();
    assert_eq!(heads, ["std_msgs/Header", "builtin_interfaces/Time"]);
    assert!(parts[0].starts_with("std_msgs/Header header\n") && parts[0].ends_with("uint8[] data\n"));
    assert!(parts[2].ends_with("uint32 nanosec\n"));
    assert_eq!(interfaces::definition("sensor_msgs/msg/Image"), Some(Image::DEFINITION));
    assert_eq!(interfaces::definition("sensor_msgs/msg/Nothing"), None);
    assert!(msg::Exposure::DEFINITION.contains("# 0 all panels off, 1..7 = L1..L7"));
}

#[test]
fn every_name_is_used_once() {
    struct Names(BTreeSet<&'static str>);
    impl MessageVisitor for Names {
        fn visit<M: Message>(&mut self) {
            assert!(self.0.insert(M::TYPE_NAME), "{} came twice", M::TYPE_NAME);
        }
    }
    let mut names = Names(BTreeSet::new());
    interfaces::visit_messages(&mut names);
    assert!(names.0.contains("rakelight_msgs/srv/SetLights_Request") && names.0.len() > 100);
}

#[test]
fn unreadable_bytes_are_named() {
    let check = |bytes: &[u8], expected: &str| {
        let error = cdr::from_slice::<Time>(bytes).unwrap_err().to_string();
        assert_eq!(
            error,
            format!("cannot deserialise builtin_interfaces/msg/Time{expected}")
        );
    };
    check(
        &[0, 1],
        ": 2 bytes; allowed: at least the 4 of the encapsulation header",
    );
    check(
        &[0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        ": encapsulation 0x0007; allowed: 0x0000 (big-endian CDR) or 0x0001 (little-endian CDR)",
    );
    check(&[0, 1, 0, 0, 9], " from 1 bytes: unexpected end of input");
    check(
        &[&[0, 1, 0, 0], [7; 17].as_slice()].concat(),
        ": 9 of 17 bytes are left over; allowed: at most 8",
    );
    let padded = [0, 1, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0];
    assert_eq!(cdr::from_slice::<Time>(&padded).unwrap(), Time { sec: 9, nanosec: 9 });
}

#[test]
fn the_tail_that_rclpy_appends_is_ignored() {
    let point = JointTrajectoryPoint {
        time_from_start: Duration { sec: 3, nanosec: 4 },
        ..Default::default()
    };
    let mut bytes = cdr::to_vec(&point).unwrap();
    assert_eq!(bytes.len(), 28);
    // rclpy's serialize_message gives 44 bytes for this message; the last 16 are whatever lay in memory.
    bytes.extend_from_slice(b"JointTrajectoryP");
    assert_eq!(cdr::from_slice::<JointTrajectoryPoint>(&bytes).unwrap(), point);
}
