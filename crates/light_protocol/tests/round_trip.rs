//! Properties of the codec: what is encoded decodes to itself, however the bytes are cut and whatever comes before.

use light_protocol::{
    Ack, BoardTime, Command, CommandKind, EndReason, Ended, Frame, FrameDecoder, Hello, Host, MAX_FRAME, MAX_PAYLOAD,
    MAX_STEPS, Message, Panels, Refusal, RefusalReason, ResetCause, Sequence, Step, StepReport, TriggerPulse, Triggers,
};
use proptest::collection::vec;
use proptest::prelude::*;

fn panels() -> impl Strategy<Value = Panels> {
    (0_u8..128).prop_map(|bits| Panels::from_bits(bits).expect("in range"))
}

fn triggers() -> impl Strategy<Value = Triggers> {
    (0_u8..4).prop_map(|bits| Triggers::from_bits(bits).expect("in range"))
}

fn board_time() -> impl Strategy<Value = BoardTime> {
    any::<u32>().prop_map(BoardTime)
}

fn command_kind() -> impl Strategy<Value = CommandKind> {
    prop_oneof![
        Just(CommandKind::Hello),
        Just(CommandKind::Off),
        Just(CommandKind::Set),
        Just(CommandKind::Sequence),
        Just(CommandKind::Ping)
    ]
}

fn step() -> impl Strategy<Value = Step> {
    (panels(), triggers(), 2500_u32..=1_000_000, 100_u32..=1_000_000).prop_map(
        |(panels, triggers, on_micros, gap_micros)| Step {
            panels,
            triggers,
            on_micros,
            gap_micros,
        },
    )
}

fn sequence() -> impl Strategy<Value = Sequence> {
    let delay = prop_oneof![Just(0), 64_u16..1000];
    (delay, 64_u16..1400, vec(step(), 1..=MAX_STEPS)).prop_map(|(delay_micros, width_micros, steps)| {
        let pulse = TriggerPulse {
            delay_micros,
            width_micros,
        };
        Sequence::new(pulse, &steps).expect("in range")
    })
}

fn command() -> impl Strategy<Value = Command> {
    prop_oneof![
        any::<u8>().prop_map(|protocol| Command::Hello { protocol }),
        Just(Command::Off),
        (panels(), 1_u16..=60_000).prop_map(|(panels, millis)| Command::set(panels, millis).expect("in range")),
        sequence().prop_map(Command::Sequence),
        Just(Command::Ping),
    ]
}

fn hello() -> impl Strategy<Value = Hello> {
    (
        any::<[u8; 3]>(),
        any::<[u8; 5]>(),
        any::<[u16; 2]>(),
        any::<u32>(),
        board_time(),
    )
        .prop_map(|(firmware_version, bytes, millis, max_step_micros, at)| Hello {
            firmware_version,
            reset_cause: ResetCause(bytes[0]),
            panels: bytes[1],
            triggers: bytes[2],
            max_steps: bytes[3],
            duty_percent: bytes[4],
            watchdog_millis: millis[0],
            max_set_millis: millis[1],
            max_step_micros,
            at,
        })
}

fn refusal() -> impl Strategy<Value = Refusal> {
    let reason = prop_oneof![
        Just(RefusalReason::BadCrc),
        Just(RefusalReason::NoHello),
        Just(RefusalReason::Busy),
        Just(RefusalReason::Duty)
    ];
    (any::<u8>(), reason, any::<u8>(), any::<u32>()).prop_map(|(command, reason, index, allowed)| Refusal {
        command,
        reason,
        index,
        allowed,
    })
}

fn step_report() -> impl Strategy<Value = StepReport> {
    (
        any::<u8>(),
        panels(),
        triggers(),
        board_time(),
        board_time(),
        board_time(),
    )
        .prop_map(|(index, panels, triggers, on_at, trigger_at, off_at)| StepReport {
            index,
            panels,
            triggers,
            on_at,
            trigger_at: (triggers != Triggers::NONE).then_some(trigger_at),
            off_at,
        })
}

fn ended() -> impl Strategy<Value = Ended> {
    let reason = prop_oneof![
        Just(EndReason::Complete),
        Just(EndReason::Expired),
        Just(EndReason::Stopped),
        Just(EndReason::Replaced),
        Just(EndReason::Silence)
    ];
    (command_kind(), reason, any::<u8>(), board_time()).prop_map(|(command, reason, steps_done, at)| Ended {
        command,
        reason,
        steps_done,
        at,
    })
}

fn message() -> impl Strategy<Value = Message> {
    prop_oneof![
        hello().prop_map(Message::Hello),
        (command_kind(), board_time(), panels()).prop_map(|(command, at, lit)| Message::Ack(Ack { command, at, lit })),
        refusal().prop_map(Message::Nak),
        hello().prop_map(Message::Boot),
        step_report().prop_map(Message::Step),
        ended().prop_map(Message::Ended),
    ]
}

/// Every whole frame among the bytes.
fn decode<'a>(bytes: impl IntoIterator<Item = &'a u8>) -> Vec<Frame> {
    let mut decoder = FrameDecoder::new();
    let results = bytes.into_iter().filter_map(|byte| decoder.push(*byte));
    results.filter_map(Result::ok).collect()
}

proptest! {
    #[test]
    fn any_frame_decodes_to_itself(kind: u8, number: u8, payload in vec(prop_oneof![Just(0_u8), any::<u8>()], 0..=MAX_PAYLOAD)) {
        let frame = Frame::new(kind, number, &payload).expect("not too long");
        let bytes = frame.encode();
        prop_assert!(bytes.len() <= MAX_FRAME && bytes[1..bytes.len() - 1].iter().all(|byte| *byte != 0));
        prop_assert_eq!(decode(bytes.iter()), [frame]);
    }

    #[test]
    fn any_command_decodes_to_itself(command in command(), number: u8) {
        let frames = decode(command.to_frame(number).encode().iter());
        prop_assert_eq!(Command::from_frame(&frames[0]), Ok(command));
        prop_assert_eq!(frames[0].sequence_number(), number);
    }

    #[test]
    fn any_message_decodes_to_itself(message in message(), number: u8) {
        let frames = decode(message.to_frame(number).encode().iter());
        prop_assert_eq!(Message::from_frame(&frames[0]), Ok(message));
    }

    #[test]
    fn garbage_never_panics_and_the_next_frame_is_found(garbage in vec(any::<u8>(), 0..1000), message in message()) {
        let mut host = Host::new();
        for byte in &garbage {
            let _ = host.receive(*byte);
        }
        let bytes = message.to_frame(9).encode();
        let last = bytes.iter().filter_map(|byte| host.receive(*byte)).last();
        let received = last.expect("a delimiter ends it").expect("the frame is whole");
        prop_assert_eq!((received.sequence_number, received.message), (9, message));
    }

    #[test]
    fn frames_of_any_content_never_panic(kind: u8, payload in vec(any::<u8>(), 0..=MAX_PAYLOAD)) {
        let frame = Frame::new(kind, 1, &payload).expect("not too long");
        let _ = Command::from_frame(&frame);
        let _ = Message::from_frame(&frame);
        // The kinds that exist, with payloads that do not fit them.
        for kind in (0x01..=0x05).chain(0x81..=0x83).chain(0x91..=0x93) {
            let frame = Frame::new(kind, 1, &payload).expect("not too long");
            let _ = Command::from_frame(&frame);
            let _ = Message::from_frame(&frame);
        }
    }

    #[test]
    fn any_split_gives_the_same_frames(messages in vec(message(), 1..6), cuts in vec(any::<prop::sample::Index>(), 0..8)) {
        let stream: Vec<u8> = messages.iter().flat_map(|message| message.to_frame(3).encode().to_vec()).collect();
        let mut ends: Vec<usize> = cuts.iter().map(|cut| cut.index(stream.len())).collect();
        ends.push(stream.len());
        ends.sort_unstable();
        let mut decoder = FrameDecoder::new();
        let (mut found, mut start) = (Vec::new(), 0);
        for end in ends {
            // As a driver does it: one read at a time, the decoder kept between them.
            let part = &stream[start..end];
            found.extend(part.iter().filter_map(|byte| decoder.push(*byte)).map(|frame| frame.expect("whole")));
            start = end;
        }
        let found: Vec<_> = found.iter().map(Message::from_frame).collect();
        prop_assert_eq!(found, messages.into_iter().map(Ok).collect::<Vec<_>>());
    }
}
