//! Bytes that the vendor's own client sends and takes.

use xarm_protocol::{
    Feedback, FeedbackKind, FeedbackResult, Frame, FrameReader, Mode, MoveCircle, MoveCircleOptions, MoveJoint,
    MoveLine, MoveLineOptions, Protocol, Reply, Request, StateCommand, Status,
};

/// "00 01" and so on.
fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(u8::is_ascii_hexdigit).collect();
    let pair = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).expect("digits"), 16).expect("digits");
    digits.chunks(2).map(pair).collect()
}

#[test]
fn requests_are_those_of_the_vendors_client() {
    let traces = [
        (Request::Version, "0001 0002 0001 01"),
        (Request::CleanError, "0001 0002 0001 10"),
        (Request::MotionEnable { axis: 8, on: true }, "0001 0002 0003 0B 08 01"),
        (Request::SetState(StateCommand::Stop), "0001 0002 0002 0C 04"),
        (Request::SetMode(Mode::Servo), "0001 0002 0002 13 01"),
        (Request::SetFeedback(2), "0001 0002 0002 FE 02"),
        (Request::ToolRead { address: 0x0A14 }, "0001 0002 0004 80 09 0A14"),
        (Request::GetMovement, "0001 0002 0001 45"),
        (Request::SelfCollisionCheck(true), "0001 0002 0002 4D 01"),
        (Request::ToolShape(vec![2]), "0001 0002 0002 4E 02"),
        (Request::Simulation(false), "0001 0002 0002 4F 00"),
        (
            // Pump on: 0x0101 = 257, as a float.
            Request::ToolWrite {
                address: 0x0A15,
                value: 257.0,
                in_queue: None,
            },
            "0001 0002 0008 7F 09 0A15 00808043",
        ),
        (
            Request::ServoJoint {
                angles: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0],
                speed: 0.0,
                acceleration: 0.0,
                time: 0.0,
            },
            "0001 0002 0029 1D 0000803F 00000000 00000000 00000000 00000000 00000000 000080BF 00000000 00000000 00000000",
        ),
    ];
    for (request, hex) in traces {
        let frame = request.frame(1, Protocol::Private);
        assert_eq!(frame.encode(), bytes(hex), "{request:?}");
        let mut written = Vec::new();
        request.encode_into(1, Protocol::Private, &mut written);
        assert_eq!(written, bytes(hex), "{request:?}");
        assert_eq!(Request::decode(frame.register(), frame.parameters()), Ok(request));
    }
}

#[test]
fn lines_have_a_short_and_a_long_form() {
    let short = MoveLine {
        pose: [300.0, 0.0, 200.0, 3.1, 0.0, 0.0],
        speed: 100.0,
        acceleration: 2000.0,
        time: 0.0,
        options: None,
    };
    let options = MoveLineOptions {
        radius: -1.0,
        in_tool: false,
        axis_angle: false,
        check_only: false,
        motion_type: None,
    };
    let long = MoveLine {
        options: Some(options),
        ..short
    };
    let newest = MoveLine {
        options: Some(MoveLineOptions {
            motion_type: Some(0),
            ..options
        }),
        ..short
    };
    for (line, parameters) in [(short, 36), (long, 43), (newest, 44)] {
        let frame = Request::MoveLine(line).frame(9, Protocol::KeepAlive);
        assert_eq!(frame.parameters().len(), parameters);
        assert_eq!(Request::decode(21, frame.parameters()), Ok(Request::MoveLine(line)));
    }
}

#[test]
fn circles_have_a_short_and_a_long_form() {
    let short = MoveCircle {
        through: [300.0, 50.0, 200.0, 3.1, 0.0, 0.0],
        to: [350.0, 0.0, 200.0, 3.1, 0.0, 0.0],
        speed: 100.0,
        acceleration: 2000.0,
        time: 0.0,
        percent: 100.0,
        options: None,
    };
    let long = MoveCircle {
        options: Some(MoveCircleOptions {
            in_tool: false,
            axis_angle: true,
            check_only: false,
        }),
        ..short
    };
    for (circle, parameters) in [(short, 64), (long, 67)] {
        let frame = Request::MoveCircle(circle).frame(9, Protocol::KeepAlive);
        assert_eq!((frame.register(), frame.parameters().len()), (27, parameters));
        assert_eq!(Request::decode(27, frame.parameters()), Ok(Request::MoveCircle(circle)));
    }
}

#[test]
fn joints_with_a_radius_have_a_register_of_their_own() {
    let full = MoveJoint {
        angles: [0.1; 7],
        speed: 0.35,
        acceleration: 8.7,
        radius: None,
        time: 0.0,
        check_only: None,
    };
    let blended = MoveJoint {
        radius: Some(5.0),
        ..full
    };
    for (joint, register) in [(full, 23), (blended, 24)] {
        let frame = Request::MoveJoint(joint).frame(2, Protocol::Private);
        assert_eq!((frame.register(), frame.parameters().len()), (register, 40));
        assert_eq!(
            Request::decode(register, frame.parameters()),
            Ok(Request::MoveJoint(joint))
        );
    }
}

#[test]
fn a_reply_has_a_status_before_its_data() {
    let mut reader = FrameReader::default();
    // State 2, while an error is there and motions would not be obeyed.
    reader.push(&bytes("0007 0003 0003 0D 50 02"));
    let frame = reader.next().expect("a frame").expect("whole");
    let reply = Reply::of_frame(&frame).expect("a reply");
    assert_eq!(reply.read_bytes(), Ok([2]));
    assert!(reply.status.has(Status::ERROR) && reply.status.has(Status::NOT_READY));
    assert!(!reply.status.has(Status::INVALID));
    assert_eq!(reply.frame(7, Protocol::KeepAlive), frame);
}

#[test]
fn feedback_tells_the_end_of_a_command() {
    let frame = bytes("002A 0003 0011 FF 00 02 17 0005 00 00000000000F4240 0000");
    let mut reader = FrameReader::default();
    reader.push(&frame);
    let frame = reader.next().expect("a frame").expect("whole");
    assert!(Feedback::is(&frame));
    let feedback = Feedback::of_frame(&frame).expect("feedback");
    let expected = Feedback {
        transaction: 42,
        kind: FeedbackKind::End,
        register: 23,
        task: 5,
        result: FeedbackResult::Done,
        micros: 1_000_000,
    };
    assert_eq!(feedback, expected);
    let written = feedback.frame(Protocol::KeepAlive);
    assert_eq!(Feedback::of_frame(&written), Ok(expected));
}

#[test]
fn frames_come_in_pieces_and_several_at_once() {
    let frame = |transaction| Frame {
        transaction,
        protocol: Protocol::Private,
        body: vec![13],
    };
    let both = [frame(1).encode(), frame(2).encode()].concat();
    for cut in 0..both.len() {
        let mut reader = FrameReader::default();
        let mut found = Vec::new();
        for piece in [&both[..cut], &both[cut..]] {
            reader.push(piece);
            while let Some(frame) = reader.next().expect("frames") {
                found.push(frame);
            }
        }
        assert_eq!(found, [frame(1), frame(2)], "cut at {cut}");
    }
}
