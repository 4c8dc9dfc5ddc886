//! The device without sockets: who may do what, and which values are taken.

mod bench;

use std::net::Ipv4Addr;
use std::time::Duration;

use bench::{Bench, HOST, OTHER, millis, picture};
use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Answer, Command};
use gige_vision::{Device, DeviceConfig, GigeVisionError, Refusal, Register, Step};
use proptest::prelude::*;

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
