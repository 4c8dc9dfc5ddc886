//! The device without sockets: which exposures are taken, and which packets leave.

mod bench;

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use bench::{Bench, HOST, OTHER, millis, picture};
use bytes::Bytes;
use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Command, Request};
use gige_vision::gvsp::{Content, Packet};
use gige_vision::{Faults, FrameRequest, GigeVisionError, Refusal, Register, Step};

impl Bench {
    /// Runs the stream until nothing more happens before `until`; gives the packets and the exposures.
    fn run(&mut self, until: Duration) -> (Vec<Vec<u8>>, Vec<FrameRequest>) {
        let (mut packets, mut exposures, mut datagram) = (Vec::new(), Vec::new(), Vec::new());
        loop {
            match self.device.next_step(self.now, &mut datagram) {
                Step::Send(destination) => {
                    assert_eq!(destination, SocketAddrV4::new(*HOST.ip(), 50_000));
                    packets.push(datagram.clone());
                }
                Step::Expose(request) => {
                    exposures.push(request);
                    let image = picture(&request);
                    self.device.deliver(&request, image).unwrap();
                }
                Step::Wait(next) if next < until => {
                    assert!(next > self.now, "waits for the past");
                    self.now = next;
                }
                Step::Wait(_) | Step::Idle => break,
            }
        }
        self.now = until;
        (packets, exposures)
    }
}

fn decoded(packets: &[Vec<u8>]) -> Vec<Packet<'_>> {
    packets.iter().map(|packet| Packet::decode(packet).unwrap()).collect()
}

#[test]
fn a_line_trigger_gives_one_whole_frame_with_its_time() {
    let mut bench = Bench::armed();
    bench.device.line_trigger(millis(10));
    let (packets, exposures) = bench.run(millis(50));
    assert_eq!((exposures.len(), exposures[0].triggered_at), (1, millis(10)));
    assert_eq!(exposures[0].exposure, Duration::from_micros(2500));
    let packets = decoded(&packets);
    let ids: Vec<u32> = packets.iter().map(|packet| packet.packet_id).collect();
    // 64 x 48 x 2 bytes in packets of 1000 bytes, leader and trailer.
    assert_eq!(ids, (0..=8).collect::<Vec<_>>());
    assert!(packets.iter().all(|packet| packet.block_id == 1 && packet.status == 0));
    let Content::Leader(leader) = packets[0].content else {
        panic!("no leader")
    };
    assert_eq!(
        (leader.timestamp_nanos, leader.width, leader.height),
        (10_000_000, 64, 48)
    );
    let image: Vec<u8> = packets
        .iter()
        .filter_map(|packet| match packet.content {
            Content::Payload(bytes) => Some(bytes),
            _ => None,
        })
        .flatten()
        .copied()
        .collect();
    assert_eq!(image, picture(&exposures[0]));
    assert_eq!(packets[8].content, Content::Trailer { height: 48 });
}

#[test]
fn triggers_into_an_exposure_or_of_another_source_are_counted_and_ignored() {
    let mut bench = Bench::armed();
    bench.device.line_trigger(millis(10));
    bench.device.line_trigger(millis(11));
    bench.set(Register::TriggerSoftware, 1).unwrap();
    bench.device.line_trigger(millis(13));
    assert_eq!(bench.run(millis(50)).1.len(), 2);
    assert_eq!(bench.device.counters().triggers_ignored, 2);
}

#[test]
fn a_command_sent_twice_triggers_once() {
    let mut bench = Bench::armed();
    bench.set(Register::TriggerSource, 0).unwrap();
    let request = Request {
        id: 900,
        acknowledge: true,
        command: Command::WriteMemory {
            address: Register::TriggerSoftware.address(),
            data: vec![0, 0, 0, 1],
        },
    };
    let first = bench.device.handle_command(millis(5), HOST, &request.encode());
    let second = bench.device.handle_command(millis(30), HOST, &request.encode());
    assert!(first.is_some() && first == second);
    assert_eq!(bench.run(millis(100)).1.len(), 1);
}

#[test]
fn acquisition_ends_after_its_frames() {
    for (mode, count, expected) in [(1, 1, 1), (2, 3, 3)] {
        let mut bench = Bench::armed();
        bench.set(Register::AcquisitionStop, 1).unwrap();
        bench.set(Register::AcquisitionMode, mode).unwrap();
        bench.set(Register::AcquisitionFrameCount, count).unwrap();
        bench.set(Register::AcquisitionStart, 1).unwrap();
        assert_eq!(
            bench.set(Register::Width, 32),
            Err(Refusal::WriteProtected),
            "locked while acquiring"
        );
        for trigger in 0..5 {
            bench.device.line_trigger(millis(10 + 5 * trigger));
        }
        assert_eq!(bench.run(millis(100)).1.len(), expected);
        assert!(!bench.device.is_acquiring());
        assert_eq!(bench.set(Register::Width, 32), Ok(()));
    }
}

#[test]
fn without_trigger_frames_follow_the_frame_rate() {
    let mut bench = Bench::armed();
    bench.set(Register::TriggerMode, 0).unwrap();
    bench.set(Register::AcquisitionFrameRate, 100_000).unwrap();
    let (_, exposures) = bench.run(millis(1001));
    assert!(
        (98..=100).contains(&exposures.len()),
        "{} frames in a second",
        exposures.len()
    );
    assert_eq!(exposures[51].triggered_at, exposures[50].triggered_at + millis(10));
}

#[test]
fn packets_keep_their_distance() {
    let mut bench = Bench::armed();
    bench.write(at::STREAM_PACKET_DELAY, 1_000_000);
    bench.device.line_trigger(millis(10));
    let (mut sent, mut datagram) = (Vec::new(), Vec::new());
    while sent.len() < 9 {
        match bench.device.next_step(bench.now, &mut datagram) {
            Step::Send(_) => sent.push(bench.now),
            Step::Expose(request) => bench.device.deliver(&request, picture(&request)).unwrap(),
            Step::Wait(until) => bench.now = until,
            Step::Idle => panic!("idle after {} packets", sent.len()),
        }
    }
    // The first two share the allowance for a late start.
    assert!(
        sent[1..].windows(2).all(|pair| pair[1] >= pair[0] + millis(1)),
        "{sent:?}"
    );
}

#[test]
fn lost_packets_are_sent_again_and_old_ones_named_unavailable() {
    let mut bench = Bench::armed();
    // Two more than are kept.
    for trigger in 0..11 {
        bench.device.line_trigger(millis(10 + 10 * trigger));
    }
    bench.run(millis(150));
    let resend = |block_id, first, last| {
        let command = Command::PacketResend {
            block_id,
            first,
            last,
            extended: false,
        };
        Request {
            id: 7,
            acknowledge: false,
            command,
        }
        .encode()
    };
    for (block, first, last) in [(11, 2, 4), (11, 8, 9000), (11, 5, 1), (2, 3, 5), (3, 8, 8)] {
        assert_eq!(
            bench
                .device
                .handle_command(bench.now, OTHER, &resend(block, first, last)),
            None
        );
    }
    let (packets, _) = bench.run(millis(250));
    let again: Vec<(u16, u32, u16)> = decoded(&packets)
        .iter()
        .map(|packet| (packet.block_id, packet.packet_id, packet.status))
        .collect();
    let resent = |id| (11, id, 0x0100);
    assert_eq!(
        again,
        [
            resent(2),
            resent(3),
            resent(4),
            resent(8),
            (2, 3, 0x800c),
            (3, 8, 0x0100)
        ]
    );
    let stranger = SocketAddrV4::new(Ipv4Addr::new(127, 9, 9, 9), 1);
    bench.device.handle_command(bench.now, stranger, &resend(11, 0, 8));
    assert!(bench.run(millis(350)).0.is_empty());
}

#[test]
fn a_test_packet_has_the_size_asked_for() {
    let mut bench = Bench::armed();
    bench.write(
        at::STREAM_PACKET_SIZE,
        at::FIRE_TEST_PACKET + at::DO_NOT_FRAGMENT + 9000,
    );
    let (packets, _) = bench.run(millis(10));
    assert_eq!(packets.iter().map(Vec::len).collect::<Vec<_>>(), [9000 - 28]);
    assert_eq!(bench.read(HOST, at::STREAM_PACKET_SIZE), Ok(at::DO_NOT_FRAGMENT + 9000));
    assert_eq!(
        bench.try_write(HOST, at::STREAM_PACKET_SIZE, 36),
        Err(Refusal::InvalidParameter)
    );
}

#[test]
fn faults_do_what_they_say() {
    let faulty = |faults: Faults| {
        let mut bench = Bench::armed();
        bench.device.set_faults(faults);
        bench.device.line_trigger(millis(10));
        let (packets, exposures) = bench.run(millis(90));
        (bench, packets, exposures)
    };
    let lossy = Faults {
        drop_ratio: 0.5,
        drop_seed: 3,
        ..Faults::default()
    };
    let (bench, some, _) = faulty(lossy);
    assert!((1..9).contains(&some.len()));
    assert_eq!(bench.device.counters().packets_dropped, 9 - some.len() as u64);
    assert_eq!(faulty(lossy).1, some, "the same seed loses the same packets");
    let (_, short, _) = faulty(Faults {
        short_frames: true,
        ..Faults::default()
    });
    assert!(matches!(decoded(&short)[0].content, Content::Leader(leader) if leader.height == 24));
    assert_eq!(short.len(), 2 + 4);
    let (_, wrong, _) = faulty(Faults {
        wrong_pixel_format: true,
        ..Faults::default()
    });
    let Content::Leader(leader) = decoded(&wrong)[0].content else {
        panic!("no leader")
    };
    assert_eq!(leader.pixel_format, gige_vision::PixelFormat::Mono8);
    let late = Faults {
        frame_delay: millis(90),
        ..Faults::default()
    };
    assert!(faulty(late).1.is_empty(), "too late for the 90 ms looked at");
    let muted = Faults {
        muted: true,
        ..Faults::default()
    };
    let (mut bench, none, _) = faulty(muted);
    assert!(none.is_empty());
    let request = Request {
        id: 1,
        acknowledge: true,
        command: Command::Discovery,
    };
    assert_eq!(bench.device.handle_command(bench.now, HOST, &request.encode()), None);
}

#[test]
fn images_of_the_wrong_size_and_of_ended_acquisitions_are_refused() {
    let mut bench = Bench::armed();
    let exposure = |bench: &mut Bench| {
        bench.device.line_trigger(bench.now);
        bench.now += millis(3);
        match bench.device.next_step(bench.now, &mut Vec::new()) {
            Step::Expose(request) => request,
            other => panic!("{other:?}"),
        }
    };
    let request = exposure(&mut bench);
    let refused = bench
        .device
        .deliver(&request, Bytes::from_static(&[1, 2, 3]))
        .unwrap_err();
    assert!(matches!(refused, GigeVisionError::ImageSize { found: 3, needed: 6144 }));
    let request = exposure(&mut bench);
    bench.set(Register::AcquisitionStop, 1).unwrap();
    bench.set(Register::AcquisitionStart, 1).unwrap();
    let stale = bench.device.deliver(&request, picture(&request)).unwrap_err();
    assert!(matches!(stale, GigeVisionError::Stale));
    let request = exposure(&mut bench);
    bench.device.deliver(&request, picture(&request)).unwrap();
}
