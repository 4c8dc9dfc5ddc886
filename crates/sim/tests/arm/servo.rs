//! Mode 1: a stream of set-points.

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use client::{Client, distance, is_done, servo, start, wait_for};
use sim::arm::{ArmConfig, ArmController};
use xarm_protocol::{Mode, Request, State, StateCommand, Status};

use crate::client;

const PERIOD: Duration = Duration::from_millis(4);

/// A wave of all joints about where they were, from rest to rest.
fn wave(home: &[f64; 7], seconds: f64) -> [f64; 7] {
    let shift = 0.05 * (1.0 - (TAU * seconds).cos());
    std::array::from_fn(|joint| home[joint] + if joint % 2 == 0 { shift } else { -shift })
}

#[test]
fn a_stream_of_two_seconds_is_followed() {
    let (sender, followed) = std::sync::mpsc::channel();
    let arm = ArmController::start_watched(ArmConfig::default(), move |moment| {
        // The receiver may be gone.
        let _ = sender.send(moment.joints);
    });
    let arm = arm.expect("an arm");
    let mut client = Client::connect(&arm);
    client.enable(Mode::Servo);
    let home = client.joints();
    let start = Instant::now();
    for point in 1..=500_u32 {
        client.fine(&servo(wave(&home, f64::from(point) * 0.004)));
        let due = start + PERIOD * point;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    let moment = wait_for(&arm, "the end", is_done);
    assert!(distance(&moment.joints, &wave(&home, 2.0)) < 1e-6);
    let trace = arm.take_servo_trace();
    assert_eq!(trace.len(), 500);
    assert!(trace.iter().all(|point| point.taken));
    // Where the arm was at any step is a set-point, or between two that follow each other.
    let followed: Vec<[f64; 7]> = followed.try_iter().collect();
    for joints in followed {
        let shift = joints[0] - home[0];
        for joint in 0..7 {
            let expected = home[joint] + if joint % 2 == 0 { shift } else { -shift };
            assert!((joints[joint] - expected).abs() < 1e-4, "joint {joint} left the path");
        }
    }
    assert_eq!(arm.take_servo_trace(), []);
}

#[test]
fn the_last_of_many_wins() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Servo);
    let home = client.joints();
    let mut target = home;
    let numbers: Vec<u16> = (0..20)
        .map(|_| {
            target[6] += 0.01;
            client.post(&servo(target))
        })
        .collect();
    for number in numbers {
        assert_eq!(client.reply_to(number).status, Status::FINE);
    }
    let moment = wait_for(&arm, "the last one", |moment| distance(&moment.joints, &target) < 1e-6);
    assert_eq!(moment.error, 0);
}

#[test]
fn set_points_are_refused_until_the_arm_is_ready() {
    let arm = start();
    let mut client = Client::connect(&arm);
    let home = client.joints();
    client.call(&Request::MotionEnable { axis: 8, on: true });
    client.call(&Request::SetState(StateCommand::Run));
    client.call(&Request::SetMode(Mode::Servo));
    let reply = client.call(&servo(home));
    assert!(reply.status.has(Status::NOT_READY), "state before mode leaves state 5");
    client.fine(&Request::SetState(StateCommand::Run));
    client.fine(&servo(home));
    client.enable(Mode::Position);
    assert!(client.call(&servo(home)).status.has(Status::INVALID), "in mode 0");
    let taken: Vec<bool> = arm.take_servo_trace().iter().map(|point| point.taken).collect();
    assert_eq!(taken, [false, true, false]);
}

#[test]
fn impossible_set_points_are_errors() {
    // What is added to the angles, and the error that it is.
    let cases = [
        // 0.02 rad in 4 ms are 5 rad/s.
        (24, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02]),
        // 3 rad/s in each joint, and the tool is some 0.35 m from the first two.
        (60, [0.012, 0.012, 0.012, 0.012, 0.0, 0.0, 0.0]),
        (23, [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ];
    for (code, added) in cases {
        let arm = start();
        let mut client = Client::connect(&arm);
        client.enable(Mode::Servo);
        let home = client.joints();
        client.fine(&servo(home));
        let reply = client.call(&servo(std::array::from_fn(|joint| home[joint] + added[joint])));
        assert!(
            reply.status.has(Status::ERROR) && reply.status.has(Status::NOT_READY),
            "{code}"
        );
        assert_eq!(client.error(), [code, 0]);
        assert_eq!(client.state(), State::Stopped);
        assert!(distance(&client.joints(), &home) < 1e-5, "it did not go there");
    }
}

#[test]
fn a_stop_brakes_within_bounds() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Servo);
    let mut target = client.joints();
    for _ in 0..30 {
        target[6] += 0.008;
        client.fine(&servo(target));
        std::thread::sleep(PERIOD);
    }
    client.call(&Request::SetState(StateCommand::Stop));
    assert_eq!(client.state(), State::Stopped);
    let end = wait_for(&arm, "rest", client::rests).joints;
    // 2 rad/s at 20 rad/s² are 0.1 rad.
    assert!((end[6] - target[6]).abs() < 0.2, "{} and {}", end[6], target[6]);
    client.call(&servo(target));
    let later = wait_for(&arm, "rest", client::rests).joints;
    assert!(distance(&later, &end) < 1e-12, "a stopped arm stays");
}
