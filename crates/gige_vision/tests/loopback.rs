//! The served device over real sockets on loopback.

mod common;

use std::net::{Ipv4Addr, UdpSocket};
use std::time::{Duration, Instant};

use bytes::Bytes;
use common::{Client, PATIENCE, wait_until};
use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Answer, Command, Request};
use gige_vision::{DeviceConfig, Faults, FrameRequest, GigeVisionError, Refusal, Server};

const IP: Ipv4Addr = Ipv4Addr::new(127, 0, 77, 1);

/// Every image differs from every other.
fn picture(request: &FrameRequest) -> Bytes {
    let first = request.index as usize * 7;
    (0..request.image_bytes())
        .map(|index| ((first + index) % 253) as u8)
        .collect()
}

fn serve() -> Server {
    let config = DeviceConfig {
        sensor_width: 128,
        sensor_height: 96,
        ..DeviceConfig::new("LOOP1", IP)
    };
    Server::start_on_port(&config, 0, picture).unwrap()
}

fn controlling(server: &Server) -> Client {
    let mut client = Client::new(server.address());
    client.take_control().unwrap();
    // A busy machine must not look like a client that died.
    client.write(at::HEARTBEAT_TIMEOUT, 60_000).unwrap();
    client
}

#[test]
fn a_broadcast_on_loopback_is_answered_from_the_devices_own_address() {
    let server = serve();
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    socket.set_broadcast(true).unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let request = Request {
        id: 0xffff,
        acknowledge: true,
        command: Command::Discovery,
    };
    let mut datagram = [0; 512];
    let end = Instant::now() + PATIENCE;
    let (length, from) = loop {
        assert!(Instant::now() < end, "nobody answered");
        let everybody = (Ipv4Addr::BROADCAST, server.address().port());
        socket.send_to(&request.encode(), everybody).unwrap();
        if let Ok(heard) = socket.recv_from(&mut datagram) {
            break heard;
        }
    };
    assert_eq!(from, server.address().into());
    let (id, Answer::Discovery(registers)) = Answer::decode(&datagram[..length]).unwrap() else {
        panic!("not an answer to discovery")
    };
    assert_eq!(id, 0xffff);
    let ip = at::CURRENT_IP as usize;
    assert_eq!(registers[ip..ip + 4], IP.octets());
    let serial = at::SERIAL as usize;
    assert_eq!(&registers[serial..serial + 6], b"LOOP1\0");
}

#[test]
fn eight_line_triggers_give_eight_frames_in_order_with_their_times() {
    let server = serve();
    let mut client = controlling(&server);
    client.arm(1500);
    let start = Instant::now();
    let instants: Vec<Instant> = (0..8).map(|index| start + Duration::from_millis(4 * index)).collect();
    for at in &instants {
        server.line_trigger(*at);
    }
    client.receive_frames(8);
    for (index, at) in instants.iter().enumerate() {
        let frame = &client.frames[&(index as u16 + 1)];
        let stamp = frame.leader.unwrap().timestamp_nanos;
        assert_eq!(u128::from(stamp), server.device_time(*at).as_nanos());
        let expected: Vec<u8> = (0..128 * 96 * 2).map(|byte| ((index * 7 + byte) % 253) as u8).collect();
        assert_eq!(frame.image(), expected, "frame {index}");
    }
    assert_eq!(server.counters().triggers_ignored, 0);
}

#[test]
fn dropped_packets_come_when_asked_for_again() {
    let server = serve();
    server.set_faults(Faults {
        drop_ratio: 0.2,
        drop_seed: 11,
        ..Faults::default()
    });
    let mut client = controlling(&server);
    client.arm(1500);
    for round in 0..2_u16 {
        server.line_trigger(Instant::now());
        client.receive_frames(round + 1);
    }
    let counters = server.counters();
    assert!(
        counters.packets_dropped > 0 && counters.packets_resent > 0,
        "{counters:?}"
    );
    assert_eq!(client.frames[&2].image().len(), 128 * 96 * 2);
}

#[test]
fn a_second_client_is_refused_until_the_first_lets_go() {
    let server = serve();
    let mut first = controlling(&server);
    let mut second = Client::new(server.address());
    assert_eq!(second.take_control(), Err(Refusal::AccessDenied));
    assert_eq!(second.read(at::CONTROL_PRIVILEGE), 2);
    first.write(at::CONTROL_PRIVILEGE, 0).unwrap();
    assert_eq!(second.take_control(), Ok(()));
}

#[test]
fn a_client_that_falls_silent_loses_control() {
    let server = serve();
    let mut client = controlling(&server);
    client.arm(1500);
    assert!(server.is_acquiring());
    client.write(at::HEARTBEAT_TIMEOUT, 500).unwrap();
    // No other client asks: the device notices by itself.
    wait_until("the end of control", || server.controller().is_none());
    assert!(!server.is_acquiring());
    assert_eq!(server.counters().heartbeats_lost, 1);
    assert_eq!(Client::new(server.address()).take_control(), Ok(()));
}

#[test]
fn a_muted_device_says_nothing_and_a_dead_one_frees_its_port() {
    let server = serve();
    let mut client = controlling(&server);
    let read = || Command::ReadRegisters(vec![at::VERSION]);
    server.set_faults(Faults {
        muted: true,
        ..Faults::default()
    });
    assert_eq!(client.try_ask(read(), Duration::from_millis(200)), None);
    server.set_faults(Faults::default());
    assert_eq!(client.ask(read()), Answer::ReadRegisters(vec![0x0002_0000]));
    let address = server.address();
    server.die();
    assert!(UdpSocket::bind(address).is_ok());
}

#[test]
fn a_port_in_use_is_an_error_that_names_it() {
    let server = serve();
    let port = server.address().port();
    let Err(error) = Server::start_on_port(&DeviceConfig::new("LOOP2", IP), port, picture) else {
        panic!("two devices at one port")
    };
    assert!(matches!(&error, GigeVisionError::Bind { address, .. } if *address == server.address()));
    assert!(
        error
            .to_string()
            .starts_with(&format!("cannot serve 127.0.77.1:{port}: "))
    );
}
