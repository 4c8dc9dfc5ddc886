//! Every packet survives the wire, and no bytes make a decoder panic.

use gige_vision::gvcp::{Answer, Command, DISCOVERY_BYTES, Request};
use gige_vision::gvsp::{Content, Leader, Packet};
use gige_vision::{GigeVisionError, PixelFormat, Refusal};
use proptest::collection::vec;
use proptest::prelude::*;

fn commands() -> impl Strategy<Value = Command> {
    let packet_id = 0_u32..0x0100_0000;
    prop_oneof![
        Just(Command::Discovery),
        vec(any::<u32>(), 1..100).prop_map(Command::ReadRegisters),
        vec(any::<(u32, u32)>(), 1..60).prop_map(Command::WriteRegisters),
        any::<(u32, u16)>().prop_map(|(address, count)| Command::ReadMemory { address, count }),
        (any::<u32>(), vec(any::<u8>(), 1..536)).prop_map(|(address, data)| Command::WriteMemory { address, data }),
        (any::<u64>(), packet_id.clone(), packet_id, any::<bool>()).prop_map(|(block_id, first, last, extended)| {
            Command::PacketResend {
                block_id: if extended { block_id } else { block_id & 0xffff },
                first,
                last,
                extended,
            }
        }),
    ]
}

fn refusals() -> impl Strategy<Value = Refusal> {
    prop_oneof![
        Just(Refusal::NotImplemented),
        Just(Refusal::InvalidParameter),
        Just(Refusal::InvalidAddress),
        Just(Refusal::WriteProtected),
        Just(Refusal::BadAlignment),
        Just(Refusal::AccessDenied),
        Just(Refusal::Busy),
    ]
}

fn answers() -> impl Strategy<Value = Answer> {
    prop_oneof![
        vec(any::<u8>(), DISCOVERY_BYTES).prop_map(Answer::Discovery),
        vec(any::<u32>(), 1..100).prop_map(Answer::ReadRegisters),
        any::<u32>().prop_map(Answer::WriteRegisters),
        (any::<u32>(), vec(any::<u8>(), 0..536)).prop_map(|(address, data)| Answer::ReadMemory { address, data }),
        any::<u32>().prop_map(Answer::WriteMemory),
        any::<u16>().prop_map(|millis| Answer::Pending { millis }),
        (0_u16..0x7fff, refusals()).prop_map(|(command, refusal)| Answer::Refused { command, refusal }),
    ]
}

fn leaders() -> impl Strategy<Value = Leader> {
    (any::<u64>(), 0_usize..3, any::<[u32; 4]>()).prop_map(|(timestamp_nanos, format, [width, height, x, y])| Leader {
        timestamp_nanos,
        pixel_format: PixelFormat::ALL[format],
        width,
        height,
        offset_x: x,
        offset_y: y,
    })
}

proptest! {
    #[test]
    fn requests_survive_the_wire(command in commands(), id in any::<u16>(), acknowledge in any::<bool>()) {
        let request = Request { id, acknowledge, command };
        prop_assert_eq!(Request::decode(&request.encode()).unwrap(), request);
    }

    #[test]
    fn answers_survive_the_wire(answer in answers(), id in any::<u16>()) {
        prop_assert_eq!(Answer::decode(&answer.encode(id)).unwrap(), (id, answer));
    }

    #[test]
    fn stream_packets_survive_the_wire(
        leader in leaders(), bytes in vec(any::<u8>(), 0..2000), kind in 0..3,
        status in any::<u16>(), block_id in any::<u16>(), packet_id in 0_u32..0x0100_0000, height in any::<u32>(),
    ) {
        let content = match kind {
            0 => Content::Leader(leader),
            1 => Content::Payload(&bytes),
            _ => Content::Trailer { height },
        };
        let packet = Packet { status, block_id, packet_id, content };
        let mut datagram = Vec::new();
        packet.encode(&mut datagram);
        prop_assert_eq!(Packet::decode(&datagram).unwrap(), packet);
    }

    #[test]
    fn a_packet_cut_short_is_an_error(command in commands(), cut in any::<prop::sample::Index>()) {
        let datagram = Request { id: 1, acknowledge: true, command }.encode();
        prop_assert!(Request::decode(&datagram[..cut.index(datagram.len())]).is_err());
    }

    #[test]
    fn garbage_never_panics(bytes in vec(any::<u8>(), 0..1600), command in 0_u16..0x90) {
        let _ = Request::decode(&bytes);
        let _ = Answer::decode(&bytes);
        let _ = Packet::decode(&bytes);
        // The same with a header that leads further in.
        let mut led = vec![0x42, 0x11];
        led.extend(command.to_be_bytes());
        led.extend((bytes.len() as u16).to_be_bytes());
        led.extend([0, 1]);
        led.extend(&bytes);
        let _ = Request::decode(&led);
        led[..2].fill(0);
        let _ = Answer::decode(&led);
    }
}

/// The bytes of a request as Aravis sends it, so that encoder and decoder are not merely wrong alike.
#[test]
fn a_read_of_the_control_privilege_has_these_bytes() {
    let request = Request {
        id: 0xff14,
        acknowledge: true,
        command: Command::ReadRegisters(vec![0xa00]),
    };
    let bytes = [0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0xff, 0x14, 0x00, 0x00, 0x0a, 0x00];
    assert_eq!(request.encode(), bytes);
    let answer = Answer::ReadRegisters(vec![2]).encode(0xff14);
    assert_eq!(answer, [0, 0, 0, 0x81, 0, 4, 0xff, 0x14, 0, 0, 0, 2]);
    let refused = Answer::Refused {
        command: 0x82,
        refusal: Refusal::AccessDenied,
    };
    assert_eq!(refused.encode(3), [0x80, 0x06, 0, 0x83, 0, 0, 0, 3]);
}

#[test]
fn a_leader_has_44_bytes_and_a_trailer_16() {
    let leader = Leader {
        timestamp_nanos: 0x0102_0304_0506_0708,
        pixel_format: PixelFormat::Mono16,
        width: 1536,
        height: 1024,
        offset_x: 4,
        offset_y: 8,
    };
    let mut datagram = Vec::new();
    let packet = |packet_id, content| Packet {
        status: 0,
        block_id: 7,
        packet_id,
        content,
    };
    packet(0, Content::Leader(leader)).encode(&mut datagram);
    let mut expected = vec![
        0, 0, 0, 7, 1, 0, 0, 0, 0, 0, 0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 0x01, 0x10, 0, 7,
    ];
    expected.extend([0, 0, 6, 0, 0, 0, 4, 0, 0, 0, 0, 4, 0, 0, 0, 8, 0, 0, 0, 0]);
    assert_eq!(datagram, expected);
    packet(9, Content::Trailer { height: 1024 }).encode(&mut datagram);
    assert_eq!(datagram, [0, 0, 0, 7, 2, 0, 0, 9, 0, 0, 0, 1, 0, 0, 4, 0]);
}

#[test]
fn errors_name_what_is_wrong() {
    assert!(matches!(
        Request::decode(&[0x41; 8]),
        Err(GigeVisionError::NotGvcp { found: 0x41 })
    ));
    let unknown = Request::decode(&[0x42, 1, 0, 0x99, 0, 0, 0, 5]).unwrap_err();
    assert_eq!(
        unknown.to_string(),
        "GVCP command 0x0099 (request 5) is not implemented"
    );
    let short = Request::decode(&[0x42, 1, 0, 0x84, 0, 4, 0, 5, 0, 0, 0, 0]).unwrap_err();
    assert_eq!(short.to_string(), "GVCP request 5: READMEM needs 4 bytes, 0 are there");
}

#[test]
fn samples_are_packed_by_cutting_low_bits() {
    let samples = [0x1234, 0xffff];
    assert_eq!(PixelFormat::Mono8.pack(&samples), [0x12, 0xff]);
    assert_eq!(PixelFormat::Mono12.pack(&samples), [0x23, 0x01, 0xff, 0x0f]);
    assert_eq!(PixelFormat::Mono16.pack(&samples), [0x34, 0x12, 0xff, 0xff]);
}
