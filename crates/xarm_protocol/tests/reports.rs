//! Reports of every kind and length.

use xarm_protocol::report::{Condition, Details};
use xarm_protocol::{Firmware, Mode, ProtocolError, Report, ReportKind, ReportReader, State};

fn report(kind: ReportKind, length: usize) -> Report {
    let condition = Condition {
        brakes: 0x7F,
        enabled: 0x7F,
        error: 31,
        warning: 0,
        tcp_offset: [0.0, 0.0, 126.0, 0.0, 0.0, 0.0],
        load: [0.61, 0.0, 0.0, 53.0],
        collision_sensitivity: 3,
        teach_sensitivity: 3,
        gravity: [0.0, 0.0, -1.0],
    };
    let details = Details {
        robot_type: 7,
        axes: 7,
        version: "v2.5.5".into(),
        tcp_motion: [1000.0, 1.0, 50000.0, 0.1, 1000.0],
        joint_motion: [20.0, 0.01, 20.0, 0.01, 3.1],
        rotation_motion: [2.3, 4.5],
        servos: [[0, 0], [3, 23], [0, 0], [0, 0], [0, 0], [0, 0], [0, 0]],
        tool_board: [0, 0],
        temperatures: (length >= 252).then_some([30, 31, 32, -5, 34, 35, 36]),
        speeds: (length >= 284).then_some((12.5, [0.1; 7])),
        power: (length >= 383).then_some(([47.5; 7], [0.25; 7])),
        flags: (length >= 574).then_some(5),
    };
    Report {
        mode: Mode::Servo,
        state: State::Stopped,
        queued: 3,
        joints: [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0],
        pose: [350.6, 0.0, 374.0, 3.1, 0.0, 0.0],
        torques: [0.5; 7],
        forces: (length == 135).then_some([[1.0; 6], [2.0; 6]]),
        condition: (kind != ReportKind::Real).then_some(condition),
        details: (kind == ReportKind::Rich).then_some(details),
    }
}

const ALL: [(ReportKind, usize); 11] = [
    (ReportKind::Real, 87),
    (ReportKind::Real, 135),
    (ReportKind::Normal, 145),
    (ReportKind::Rich, 245),
    (ReportKind::Rich, 252),
    (ReportKind::Rich, 284),
    (ReportKind::Rich, 383),
    (ReportKind::Rich, 433),
    (ReportKind::Rich, 494),
    (ReportKind::Rich, 574),
    (ReportKind::Rich, 587),
];

#[test]
fn reports_are_read_as_they_are_written_in_any_pieces() {
    for (kind, length) in ALL {
        let report = report(kind, length);
        let bytes = report.encode(kind, length);
        assert_eq!(bytes.len(), length);
        let stream = [&bytes[..], &bytes[..]].concat();
        let mut reader = ReportReader::new(kind);
        let mut found = Vec::new();
        for piece in stream.chunks(61) {
            reader.push(piece);
            while let Some(report) = reader.next().expect("reports") {
                found.push(report);
            }
        }
        assert_eq!(found, [report.clone(), report], "{kind:?} {length}");
    }
}

#[test]
fn fields_lie_where_the_vendors_client_looks_for_them() {
    let bytes = report(ReportKind::Rich, 587).encode(ReportKind::Rich, 587);
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
    assert_eq!(bytes[..4], [0, 0, 2, 75]);
    assert_eq!((bytes[4], bytes[89]), (0x14, 31));
    assert_eq!((float(11), float(43), float(99)), (-0.4, 374.0, 126.0));
    assert_eq!((float(115), bytes[131], bytes[145]), (0.61, 3, 7));
    assert_eq!(&bytes[151..157], b"v2.5.5");
    assert_eq!((float(181), float(201), float(221)), (1000.0, 20.0, 2.3));
    assert_eq!((bytes[231], bytes[232], bytes[245], float(252)), (3, 23, 30, 12.5));
    assert_eq!(
        (bytes[341..343].to_vec(), float(355), bytes[494]),
        (vec![18, 142], 0.25, 5)
    );
}

#[test]
fn a_length_that_no_controller_sends_is_named() {
    let mut reader = ReportReader::new(ReportKind::Real);
    reader.push(&[0, 0, 0, 88, 0x12]);
    let error = reader.next().expect_err("odd length");
    assert_eq!(error.to_string(), "a real-time report of 88 bytes; known are 87, 135");
}

#[test]
fn a_length_that_changes_is_an_error() {
    let mut reader = ReportReader::new(ReportKind::Real);
    for length in [87, 135] {
        reader.push(&report(ReportKind::Real, length).encode(ReportKind::Real, length));
    }
    assert!(reader.next().expect("the first is whole").is_some());
    assert!(matches!(
        reader.next(),
        Err(ProtocolError::ReportLength { found: 135, .. })
    ));
}

#[test]
fn values_without_meaning_are_refused() {
    let mut bytes = report(ReportKind::Normal, 145).encode(ReportKind::Normal, 145);
    bytes[131] = 6;
    let error = Report::decode(ReportKind::Normal, &bytes).expect_err("too sensitive");
    assert_eq!(error.to_string(), "collision sensitivity is 6, allowed: 0 to 5");
    bytes[4] = 0xC2;
    assert!(matches!(
        Report::decode(ReportKind::Normal, &bytes),
        Err(ProtocolError::Value {
            what: "mode",
            found: 12,
            ..
        })
    ));
}

#[test]
fn every_supported_firmware_has_a_length_that_is_read() {
    for firmware in ["v1.8.4", "v1.12.10", "v2.5.5", "v2.7.1", "v2.9.0"] {
        let firmware: Firmware = firmware.parse().expect("a version");
        for kind in [ReportKind::Real, ReportKind::Normal, ReportKind::Rich] {
            let bytes = report(kind, kind.length(firmware)).encode(kind, kind.length(firmware));
            let mut reader = ReportReader::new(kind);
            reader.push(&bytes);
            assert!(reader.next().expect("known").is_some(), "{firmware} {kind:?}");
        }
    }
}
