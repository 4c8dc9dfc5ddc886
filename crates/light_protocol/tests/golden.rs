//! The golden frames, against the typed values that they stand for.

use light_protocol::{
    Ack, BoardTime, Command, CommandKind, EndReason, Ended, FrameDecoder, Hello, LightProtocolError, Message, Panels,
    Refusal, RefusalReason, ResetCause, Sequence, Step, StepReport, TriggerPulse, Triggers,
};

const GOLDEN: &str = include_str!("../golden_frames.txt");
const START: BoardTime = BoardTime(1_000_000);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Content {
    Command(Command),
    Message(Message),
}

fn golden_frames() -> impl Iterator<Item = (&'static str, Vec<u8>)> {
    let lines = GOLDEN.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| {
        let mut columns = line.split(" | ");
        let name = columns.next().expect("a name");
        let digits = columns.next().expect("bytes in hex").as_bytes();
        let byte = |pair: &[u8]| {
            let text = str::from_utf8(pair).expect("ASCII");
            u8::from_str_radix(text, 16).expect("hexadecimal digits")
        };
        (name, digits.chunks(2).map(byte).collect())
    })
}

fn sequence() -> Sequence {
    let pulse = TriggerPulse {
        delay_micros: 300,
        width_micros: 500,
    };
    let dark = Step {
        panels: Panels::NONE,
        triggers: Triggers::BOTH,
        on_micros: 2500,
        gap_micros: 500,
    };
    let lit = Step { panels: l1(), ..dark };
    Sequence::new(pulse, &[dark, lit]).expect("in range")
}

fn l1() -> Panels {
    Panels::single(1).expect("exists")
}

fn l1_and_l7() -> Panels {
    l1().with(Panels::single(7).expect("exists"))
}

fn hello(reset_cause: u8) -> Hello {
    Hello {
        firmware_version: [1, 0, 0],
        reset_cause: ResetCause(reset_cause),
        panels: 7,
        triggers: 2,
        max_steps: 16,
        duty_percent: 50,
        watchdog_millis: 500,
        max_set_millis: 60_000,
        max_step_micros: 1_000_000,
        at: START,
    }
}

fn ack(command: CommandKind, at: u32, lit: Panels) -> Content {
    Content::Message(Message::Ack(Ack {
        command,
        at: BoardTime(at),
        lit,
    }))
}

fn nak(command: u8, reason: RefusalReason, allowed: u32) -> Content {
    Content::Message(Message::Nak(Refusal {
        command,
        reason,
        index: 0,
        allowed,
    }))
}

fn step(index: u8, panels: Panels, on_at: u32) -> Content {
    Content::Message(Message::Step(StepReport {
        index,
        panels,
        triggers: Triggers::BOTH,
        on_at: BoardTime(on_at),
        trigger_at: Some(BoardTime(on_at + 300)),
        off_at: BoardTime(on_at + 2500),
    }))
}

fn ended(command: CommandKind, reason: EndReason, steps_done: u8, at: u32) -> Content {
    Content::Message(Message::Ended(Ended {
        command,
        reason,
        steps_done,
        at: BoardTime(at),
    }))
}

/// Sequence number and meaning of each golden frame; `None` for those that must not decode.
fn meaning(name: &str) -> Option<(u8, Content)> {
    use CommandKind::{Off, Ping, Set};
    Some(match name {
        "hello" => (1, Content::Command(Command::HELLO)),
        "hello_other_version" => (9, Content::Command(Command::Hello { protocol: 2 })),
        "off" => (4, Content::Command(Command::Off)),
        "set" => (3, Content::Command(Command::set(l1_and_l7(), 1500).expect("in range"))),
        "sequence" => (5, Content::Command(Command::Sequence(sequence()))),
        "ping" => (2, Content::Command(Command::Ping)),
        "hello_reply" => (1, Content::Message(Message::Hello(hello(1)))),
        "ack_ping" => (2, ack(Ping, 1_000_000, Panels::NONE)),
        "ack_set" => (3, ack(Set, 1_000_000, l1_and_l7())),
        "ack_off" => (4, ack(Off, 1_000_000, Panels::NONE)),
        "ack_sequence" => (5, ack(CommandKind::Sequence, 1_001_000, Panels::NONE)),
        "nak_bad_crc" => (0, nak(0, RefusalReason::BadCrc, 0)),
        "nak_no_hello" => (2, nak(5, RefusalReason::NoHello, 1)),
        "nak_busy" => (5, nak(4, RefusalReason::Busy, 0)),
        "boot" => (0, Content::Message(Message::Boot(hello(8)))),
        "step_dark" => (5, step(0, Panels::NONE, 1_001_000)),
        "step_lit" => (5, step(1, l1(), 1_004_000)),
        "ended_stopped" => (3, ended(Set, EndReason::Stopped, 0, 1_000_000)),
        "ended_complete" => (5, ended(CommandKind::Sequence, EndReason::Complete, 2, 1_006_500)),
        "ended_silence" => (3, ended(Set, EndReason::Silence, 0, 1_500_000)),
        "broken_crc" | "broken_cobs" | "broken_short" | "broken_long" => return None,
        other => panic!("golden frame {other} has no meaning in this test"),
    })
}

#[test]
fn golden_frames_decode_to_their_meaning_and_encode_from_it() -> Result<(), LightProtocolError> {
    let mut seen = 0;
    for (name, bytes) in golden_frames() {
        let mut decoder = FrameDecoder::new();
        let results: Vec<_> = bytes.iter().filter_map(|byte| decoder.push(*byte)).collect();
        assert_eq!(results.len(), 1, "{name}");
        let Some((number, content)) = meaning(name) else {
            assert!(results[0].is_err(), "{name}: {results:?}");
            continue;
        };
        let frame = results[0].clone()?;
        assert_eq!(frame.sequence_number(), number, "{name}");
        let (decoded, encoded) = match content {
            Content::Command(command) => (Content::Command(Command::from_frame(&frame)?), command.to_frame(number)),
            Content::Message(message) => (Content::Message(Message::from_frame(&frame)?), message.to_frame(number)),
        };
        assert_eq!(decoded, content, "{name}");
        assert_eq!(*encoded.encode(), *bytes, "{name}");
        seen += 1;
    }
    assert_eq!(seen, 20, "golden frames with a meaning");
    Ok(())
}

#[test]
fn every_changed_bit_of_a_golden_frame_is_noticed() {
    for (name, bytes) in golden_frames().filter(|(name, _)| meaning(name).is_some()) {
        // The delimiters left out: without the first one the frame is still whole.
        for bit in 8..8 * (bytes.len() - 1) {
            let mut changed = bytes.clone();
            changed[bit / 8] ^= 1 << (bit % 8);
            let mut decoder = FrameDecoder::new();
            let found = changed
                .iter()
                .filter_map(|byte| decoder.push(*byte))
                .find(Result::is_ok);
            assert_eq!(found, None, "{name}, bit {bit}");
        }
    }
}
