//! Several clients, broken ones, and a network that fails.

use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use client::{Client, Reports, joint_move, start, wait_for};
use sim::arm::{ArmConfig, ArmController, ArmFaults};
use xarm_protocol::{FeedbackKind, FrameReader, Mode, Protocol, Reply, ReportKind, Request, State};

use crate::client;

const AWAY: [f32; 7] = [0.3, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

#[test]
fn clients_see_what_others_do_and_are_told_only_of_their_own() {
    let arm = start();
    let (mut first, mut second) = (Client::connect(&arm), Client::connect(&arm));
    first.enable(Mode::Position);
    second.fine(&Request::SetFeedback(2));
    first.fine(&joint_move(AWAY, 2.0));
    let number = second.post(&Request::QueueMarker);
    second.reply_to(number);
    let told = second.next_feedback();
    assert_eq!((told.transaction, told.kind), (number, FeedbackKind::End));
    assert!(
        (second.joints()[0] - 0.3).abs() < 1e-6,
        "the marker waited for the other's move"
    );
    second.call(&Request::SetMode(Mode::Servo));
    assert_eq!(first.state(), State::Changed, "the other took the mode");
    assert!(first.feedback.is_empty());
    assert_eq!(arm.clients(), 2);
}

#[test]
fn another_client_can_be_played() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Servo);
    arm.request(&Request::SetMode(Mode::Position));
    assert_eq!(client.state(), State::Changed);
}

#[test]
fn what_is_no_frame_closes_that_client_alone() {
    let arm = start();
    let mut good = Client::connect(&arm);
    // A length that no frame has; a protocol that nobody speaks.
    for bytes in [
        &[0, 1, 0, 2, 0xFF, 0xFF, 1][..],
        &[0, 1, 0, 7, 0, 1, 13],
        &[0, 1, 0, 2, 0, 0],
    ] {
        let mut bad = Client::connect(&arm);
        bad.send(bytes);
        assert_eq!(bad.read(), None, "{bytes:?}");
        good.state();
    }
}

#[test]
fn frames_come_in_pieces() {
    let arm = start();
    let mut client = Client::connect(&arm);
    let frames: Vec<u8> = (1..=3)
        .flat_map(|number| Request::GetState.frame(number, Protocol::Private).encode())
        .collect();
    for piece in frames.chunks(5) {
        client.send(piece);
    }
    let numbers: Vec<u16> = (0..3).map(|_| client.read().expect("an answer").transaction).collect();
    assert_eq!(numbers, [1, 2, 3]);
}

#[test]
fn dropped_clients_may_come_again() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Servo);
    arm.drop_clients();
    assert_eq!(client.read(), None);
    let mut client = Client::connect(&arm);
    assert_eq!(client.state(), State::Ready, "the controller itself is as it was");
}

#[test]
fn a_paused_network_delivers_afterwards() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.state();
    let (pause, begin) = (Duration::from_millis(200), Instant::now());
    arm.pause_network(pause);
    let numbers: Vec<u16> = (0..5).map(|_| client.post(&Request::GetState)).collect();
    for number in numbers {
        client.reply_to(number);
    }
    assert!(begin.elapsed() >= pause);
}

#[test]
fn answers_can_be_late() {
    let arm = start();
    let mut client = Client::connect(&arm);
    let delay = Duration::from_millis(50);
    arm.set_faults(ArmFaults {
        delay,
        ..ArmFaults::default()
    });
    let begin = Instant::now();
    client.state();
    assert!(begin.elapsed() >= delay);
}

#[test]
fn a_silent_controller_reads_and_forgets() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.state();
    arm.set_faults(ArmFaults {
        silent: true,
        ..ArmFaults::default()
    });
    client.post(&Request::MotionEnable { axis: 8, on: true });
    // Reports go on meanwhile; after one the request has certainly been read.
    let mut reports = Reports::connect(&arm, ReportKind::Rich);
    reports.next();
    arm.set_faults(ArmFaults::default());
    let number = client.post(&Request::GetState);
    client.reply_to(number);
    assert_eq!(reports.next().condition.expect("rich").enabled, 0);
}

#[test]
fn a_controller_that_was_off_comes_back_where_it_was() {
    let arm = start();
    let mut client = Client::connect(&arm);
    let mut reports = Reports::connect(&arm, ReportKind::Real);
    client.enable(Mode::Position);
    client.fine(&joint_move(AWAY, 2.0));
    wait_for(&arm, "the move", client::is_done);
    reports.next();
    arm.switch_off();
    assert_eq!(client.read(), None);
    assert!(
        std::iter::from_fn(|| reports.read()).all(|report| report.is_ok()),
        "then it is closed"
    );
    let place = std::net::SocketAddr::from((arm.address(), arm.ports().control));
    assert!(std::net::TcpStream::connect(place).is_err());
    arm.switch_on().expect("the same ports");
    let mut client = Client::connect(&arm);
    assert_eq!(client.state(), State::Stopped);
    assert!((client.joints()[0] - 0.3).abs() < 1e-6);
    Reports::connect(&arm, ReportKind::Real).next();
    client.enable(Mode::Position);
}

#[test]
fn a_unix_socket_answers_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("xarmcontroller_uds_502");
    let config = ArmConfig {
        socket: Some(path.clone()),
        ..ArmConfig::default()
    };
    let arm = ArmController::start(config).expect("an arm");
    let mut stream = UnixStream::connect(&path).expect("the socket is there");
    std::io::Write::write_all(&mut stream, &Request::Version.frame(1, Protocol::Private).encode()).expect("open");
    let mut reader = FrameReader::default();
    let frame = loop {
        let mut buffer = [0; 256];
        let count = std::io::Read::read(&mut stream, &mut buffer).expect("an answer");
        reader.push(&buffer[..count]);
        if let Some(frame) = reader.next().expect("a frame") {
            break frame;
        }
    };
    assert!(
        Reply::of_frame(&frame)
            .expect("a reply")
            .data
            .starts_with(b"7,7,XI1305")
    );
    drop(arm);
    assert!(!path.exists(), "it is tidied away");
}

#[test]
fn a_port_that_is_taken_is_named() {
    let arm = start();
    let mut config = ArmConfig::default();
    config.ports.control = arm.ports().control;
    let error = ArmController::start(config).map(|_| ()).expect_err("taken");
    let place = format!("control port at 127.0.0.1:{}", arm.ports().control);
    assert!(error.to_string().contains(&place), "{error}");
}
