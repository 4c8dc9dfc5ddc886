//! The device without sockets: who may do what, which exposures are taken, which packets leave.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use bytes::Bytes;
use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Answer, Command, Request};
use gige_vision::gvsp::{Content, Packet};
use gige_vision::{Device, DeviceConfig, Faults, FrameRequest, GigeVisionError, Refusal, Register, Step};
use proptest::prelude::*;

const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 40_000);
const OTHER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 40_001);

fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// A device and the next request id.
struct Bench {
    device: Device,
    id: u16,
    now: Duration,
}

impl Bench {
    fn new() -> Self {
        let config = DeviceConfig {
            sensor_width: 64,
            sensor_height: 48,
            ..DeviceConfig::new("T1", Ipv4Addr::new(127, 0, 0, 9))
        };
        Self {
            device: Device::new(&config).unwrap(),
            id: 0,
            now: millis(1),
        }
    }

    fn ask(&mut self, from: SocketAddrV4, command: Command) -> Answer {
        self.id += 1;
        let request = Request {
            id: self.id,
            acknowledge: true,
            command,
        };
        let answer = self.device.handle_command(self.now, from, &request.encode());
        let (id, answer) = Answer::decode(&answer.expect("an answer")).unwrap();
        assert_eq!(id, self.id);
        answer
    }

    fn try_write(&mut self, from: SocketAddrV4, address: u32, value: u32) -> Result<(), Refusal> {
        match self.ask(from, Command::WriteRegisters(vec![(address, value)])) {
            Answer::WriteRegisters(1) => Ok(()),
            Answer::Refused { refusal, .. } => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    fn write(&mut self, address: u32, value: u32) {
        self.try_write(HOST, address, value).unwrap();
    }

    fn set(&mut self, register: Register, value: u32) -> Result<(), Refusal> {
        self.try_write(HOST, register.address(), value)
    }

    fn read(&mut self, from: SocketAddrV4, address: u32) -> Result<u32, Refusal> {
        match self.ask(from, Command::ReadRegisters(vec![address])) {
            Answer::ReadRegisters(values) => Ok(values[0]),
            Answer::Refused { refusal, .. } => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    /// Control taken, stream open, waiting for the trigger line.
    fn armed() -> Self {
        let mut bench = Self::new();
        bench.write(at::CONTROL_PRIVILEGE, 2);
        bench.write(at::STREAM_DESTINATION, u32::from(*HOST.ip()));
        bench.write(at::STREAM_PORT, 50_000);
        bench.write(at::STREAM_PACKET_SIZE, 1036);
        bench.set(Register::TriggerMode, 1).unwrap();
        bench.set(Register::TriggerSource, 1).unwrap();
        bench.set(Register::AcquisitionStart, 1).unwrap();
        bench
    }

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

fn picture(request: &FrameRequest) -> Bytes {
    (0..request.image_bytes()).map(|index| (index % 251) as u8).collect()
}

fn decoded(packets: &[Vec<u8>]) -> Vec<Packet<'_>> {
    packets.iter().map(|packet| Packet::decode(packet).unwrap()).collect()
}

#[test]
fn only_one_client_controls_and_others_read() {
    let mut bench = Bench::new();
    assert_eq!(
        bench.set(Register::Gain, 5),
        Err(Refusal::AccessDenied),
        "nobody controls yet"
    );
    bench.write(at::CONTROL_PRIVILEGE, 2);
    assert_eq!(
        bench.try_write(OTHER, at::CONTROL_PRIVILEGE, 2),
        Err(Refusal::AccessDenied)
    );
    assert_eq!(
        bench.try_write(OTHER, at::CONTROL_PRIVILEGE, 0),
        Err(Refusal::AccessDenied)
    );
    assert_eq!(
        bench.try_write(OTHER, Register::Gain.address(), 5),
        Err(Refusal::AccessDenied)
    );
    assert_eq!(bench.read(OTHER, at::CONTROL_PRIVILEGE), Ok(2));
    bench.write(at::CONTROL_PRIVILEGE, 3);
    assert_eq!(
        bench.read(OTHER, at::CONTROL_PRIVILEGE),
        Err(Refusal::AccessDenied),
        "exclusive"
    );
    assert!(matches!(bench.ask(OTHER, Command::Discovery), Answer::Discovery(_)));
    bench.write(at::CONTROL_PRIVILEGE, 0);
    assert_eq!(bench.try_write(OTHER, at::CONTROL_PRIVILEGE, 2), Ok(()));
}

#[test]
fn silence_frees_control_and_ends_the_stream() {
    let mut bench = Bench::armed();
    bench.now += millis(2999);
    assert_eq!(bench.read(HOST, at::CONTROL_PRIVILEGE), Ok(2));
    bench.now += millis(3000);
    assert_eq!(
        bench.read(OTHER, at::CONTROL_PRIVILEGE),
        Ok(2),
        "not yet: the host was heard"
    );
    bench.now += millis(1);
    assert_eq!(bench.read(OTHER, at::CONTROL_PRIVILEGE), Ok(0));
    assert!(!bench.device.is_acquiring() && bench.device.stream_destination().is_none());
    assert_eq!(bench.device.counters().heartbeats_lost, 1);
    assert_eq!(bench.try_write(OTHER, at::CONTROL_PRIVILEGE, 2), Ok(()));
}

#[test]
fn values_out_of_range_are_refused_and_change_nothing() {
    let mut bench = Bench::new();
    bench.write(at::CONTROL_PRIVILEGE, 2);
    for (register, value) in [
        (Register::ExposureTime, 9_999),
        (Register::ExposureTime, 1_000_000_001),
        (Register::Gain, 24_001),
        (Register::BlackLevel, 4096),
        (Register::PixelFormat, 0x0110_0003),
        (Register::Width, 68),
        (Register::Width, 15),
        (Register::Width, 62),
        (Register::OffsetX, 4),
        (Register::BinningVertical, 5),
        (Register::AcquisitionFrameCount, 0),
        (Register::AcquisitionStart, 2),
    ] {
        let before = bench.device.register(register);
        assert_eq!(
            bench.set(register, value),
            Err(Refusal::InvalidParameter),
            "{register:?} {value}"
        );
        assert_eq!(bench.device.register(register), before);
    }
    assert_eq!(bench.set(Register::SensorWidth, 64), Err(Refusal::WriteProtected));
    assert_eq!(bench.try_write(HOST, at::VENDOR, 1), Err(Refusal::WriteProtected));
    assert_eq!(bench.try_write(HOST, 0x9000, 1), Err(Refusal::InvalidAddress));
    assert_eq!(bench.try_write(HOST, 0x8001, 1), Err(Refusal::BadAlignment));
    assert_eq!(bench.read(HOST, 0xffff_fffc), Err(Refusal::InvalidAddress));
    bench.set(Register::Width, 32).unwrap();
    bench.set(Register::OffsetX, 32).unwrap();
    bench.set(Register::BinningHorizontal, 2).unwrap();
    assert_eq!(
        (
            bench.device.register(Register::Width),
            bench.device.register(Register::OffsetX)
        ),
        (32, 0)
    );
}

#[test]
fn the_description_lies_where_the_url_says() {
    let mut bench = Bench::new();
    let Answer::ReadMemory { data, .. } = bench.ask(
        HOST,
        Command::ReadMemory {
            address: at::FIRST_URL,
            count: 512,
        },
    ) else {
        panic!("no url")
    };
    let url = String::from_utf8(data).unwrap();
    let parts: Vec<&str> = url.trim_end_matches('\0').split(';').collect();
    let place = u32::from_str_radix(parts[1], 16).unwrap();
    let size = u32::from_str_radix(parts[2], 16).unwrap();
    let mut xml = Vec::new();
    while xml.len() < size as usize {
        let address = place + xml.len() as u32;
        let count = 512.min(size - xml.len() as u32) as u16;
        match bench.ask(HOST, Command::ReadMemory { address, count }) {
            Answer::ReadMemory { data, .. } => xml.extend(data),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(xml, bench.device.xml());
    let xml = String::from_utf8(xml).unwrap();
    assert!(xml.starts_with("<?xml") && xml.trim_end().ends_with("</RegisterDescription>"));
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
    let apart = exposures[51].triggered_at - exposures[50].triggered_at;
    assert_eq!(apart, millis(10));
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
        sent[1..].windows(2).all(|pair| pair[1] - pair[0] >= millis(1)),
        "{sent:?}"
    );
}

#[test]
fn lost_packets_are_sent_again_and_old_ones_named_unavailable() {
    let mut bench = Bench::armed();
    for trigger in 0..6 {
        bench.device.line_trigger(millis(10 + 10 * trigger));
    }
    bench.run(millis(100));
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
    for (block, first, last) in [(6, 2, 4), (6, 8, 9000), (6, 5, 1), (1, 3, 5)] {
        assert_eq!(
            bench
                .device
                .handle_command(bench.now, OTHER, &resend(block, first, last)),
            None
        );
    }
    let (packets, _) = bench.run(millis(200));
    let again: Vec<(u16, u32, u16)> = decoded(&packets)
        .iter()
        .map(|packet| (packet.block_id, packet.packet_id, packet.status))
        .collect();
    let resent = |id| (6, id, 0x0100);
    assert_eq!(again, [resent(2), resent(3), resent(4), resent(8), (1, 3, 0x800c)]);
    let stranger = SocketAddrV4::new(Ipv4Addr::new(127, 9, 9, 9), 1);
    bench.device.handle_command(bench.now, stranger, &resend(6, 0, 8));
    assert!(bench.run(millis(300)).0.is_empty());
}

#[test]
fn a_test_packet_has_the_size_asked_for() {
    let mut bench = Bench::armed();
    bench.write(
        at::STREAM_PACKET_SIZE,
        at::FIRE_TEST_PACKET | at::DO_NOT_FRAGMENT | 9000,
    );
    let (packets, _) = bench.run(millis(10));
    assert_eq!(packets.iter().map(Vec::len).collect::<Vec<_>>(), [9000 - 28]);
    assert_eq!(bench.read(HOST, at::STREAM_PACKET_SIZE), Ok(at::DO_NOT_FRAGMENT | 9000));
    assert_eq!(
        bench.try_write(HOST, at::STREAM_PACKET_SIZE, 36),
        Err(Refusal::InvalidParameter)
    );
}

#[test]
fn the_clock_is_latched() {
    let mut bench = Bench::armed();
    bench.now = Duration::new(5, 7);
    assert_eq!(
        bench.read(OTHER, at::CONTROL_PRIVILEGE),
        Ok(0),
        "control has run out by then"
    );
    bench.write(at::CONTROL_PRIVILEGE, 2);
    bench.write(at::TIMESTAMP_CONTROL, 2);
    let nanos = u64::from(bench.read(HOST, at::TIMESTAMP_VALUE).unwrap()) << 32
        | u64::from(bench.read(HOST, at::TIMESTAMP_VALUE + 4).unwrap());
    assert_eq!(nanos, 5_000_000_007);
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

#[test]
fn impossible_devices_are_refused() {
    let config = |serial: &str, sensor_width| DeviceConfig {
        sensor_width,
        ..DeviceConfig::new(serial, Ipv4Addr::LOCALHOST)
    };
    assert!(matches!(
        Device::new(&config("", 64)),
        Err(GigeVisionError::Name { field: "serial", .. })
    ));
    assert!(Device::new(&config("sixteen letters!", 64)).is_err());
    assert!(matches!(
        Device::new(&config("T", 66)),
        Err(GigeVisionError::SensorSize { width: 66, .. })
    ));
}

proptest! {
    /// Whatever arrives, in control or not, the device answers or stays silent, and its stream goes on.
    #[test]
    fn no_datagram_makes_the_device_panic(
        datagrams in prop::collection::vec((0_u16..0x90, prop::collection::vec(any::<u8>(), 0..64)), 1..20),
        writes in prop::collection::vec((0_u32..0x26, any::<u32>(), 0_u32..3), 0..40),
    ) {
        let mut bench = Bench::armed();
        for (register, value, place) in writes {
            let base = [at::OWN_REGISTERS, at::STREAM_PORT, at::HEARTBEAT_TIMEOUT][place as usize];
            // Small values are the ones that are accepted.
            let _ = bench.try_write(HOST, base + 4 * register, value >> (value % 32));
            bench.device.line_trigger(bench.now);
        }
        for (command, body) in datagrams {
            let mut datagram = vec![0x42, 1];
            datagram.extend(command.to_be_bytes());
            datagram.extend((body.len() as u16).to_be_bytes());
            datagram.extend([0, 1]);
            datagram.extend(&body);
            bench.device.handle_command(bench.now, HOST, &datagram);
            bench.device.handle_command(bench.now, OTHER, &body);
        }
        let mut datagram = Vec::new();
        for _ in 0..200 {
            match bench.device.next_step(bench.now, &mut datagram) {
                Step::Expose(request) => { let _ = bench.device.deliver(&request, picture(&request)); }
                Step::Wait(until) => bench.now = bench.now.max(until),
                Step::Send(_) | Step::Idle => {}
            }
        }
    }
}
