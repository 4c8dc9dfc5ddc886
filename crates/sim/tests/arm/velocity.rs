//! Modes 4 and 5: velocities.

use client::{Client, distance, is_done, of_firmware, start, wait_for};
use sim::arm::ArmController;
use xarm_protocol::{Mode, Request, State, StateCommand};

use crate::client;

fn joints(velocities: [f32; 7], duration: Option<f32>) -> Request {
    Request::JointVelocity {
        velocities,
        synchronous: true,
        duration,
    }
}

#[test]
fn joints_turn_as_fast_as_asked_and_end_in_time() {
    for version in ["v1.8.4", "v2.5.5"] {
        let arm = ArmController::start(of_firmware(version)).expect("an arm");
        let mut client = Client::connect(&arm);
        client.enable(Mode::JointVelocity);
        let before = client.joints();
        client.fine(&joints([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, -0.25], Some(1.2)));
        let moment = wait_for(&arm, "full speed", |moment| (moment.velocities[0] - 0.5).abs() < 1e-6);
        assert!((moment.velocities[6] + 0.25).abs() < 1e-6);
        assert_eq!(moment.state, State::Moving);
        let end = wait_for(&arm, "the end", is_done).joints;
        // Speeds rise and fall with the same acceleration, the falling begins after the duration.
        assert!((end[0] - before[0] - 0.6).abs() < 0.01, "{}", end[0] - before[0]);
    }
}

#[test]
fn the_tool_goes_straight() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::CartesianVelocity);
    let before = client.pose();
    client.fine(&Request::CartesianVelocity {
        velocity: [0.0, 100.0, 0.0, 0.0, 0.0, 0.0],
        in_tool: false,
        duration: Some(0.5),
    });
    wait_for(&arm, "motion", |moment| {
        moment.state == State::Moving && !client::rests(moment)
    });
    wait_for(&arm, "the end", is_done);
    let after = client.pose();
    let moved: [f32; 6] = std::array::from_fn(|axis| after[axis] - before[axis]);
    assert!((moved[1] - 50.0).abs() < 1.0, "{moved:?}");
    assert!(moved[0].abs() < 0.5 && moved[2].abs() < 0.5, "{moved:?}");
}

#[test]
fn the_end_of_a_joints_range_is_an_error() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::JointVelocity);
    client.fine(&joints([0.0, 0.0, 0.0, 0.0, 0.0, -2.0, 0.0], None));
    let moment = wait_for(&arm, "the error", |moment| moment.error != 0);
    assert_eq!(
        (moment.error, moment.state, moment.mode),
        (23, State::Stopped, Mode::Position)
    );
}

#[test]
fn too_fast_is_an_error() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::JointVelocity);
    client.fine(&joints([3.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], None));
    assert_eq!(wait_for(&arm, "the error", |moment| moment.error != 0).error, 24);
}

#[test]
fn a_stop_ends_it() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::JointVelocity);
    client.fine(&joints([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], None));
    wait_for(&arm, "speed", |moment| moment.velocities[0] > 0.9);
    client.call(&Request::SetState(StateCommand::Stop));
    let end = wait_for(&arm, "rest", client::rests).joints;
    client.call(&joints([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], None));
    assert!(distance(&client.joints(), &end) < 1e-6);
}
