//! Mode 0: planned motions in a queue.

use client::{Client, distance, is_done, joint_move, line, of_firmware, start, wait_for};
use sim::arm::{ArmConfig, ArmController, ArmMoment};
use xarm_protocol::{
    FeedbackKind, FeedbackResult, Mode, MoveCircle, MoveJoint, MoveLine, MoveLineOptions, Request, State, StateCommand,
    Status,
};

use crate::client;

const HOME: [f32; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
const AWAY: [f32; 7] = [0.6, -0.2, 0.1, 0.9, -0.3, 1.0, 0.5];

/// An arm whose every step is kept.
fn watched() -> (ArmController, std::sync::mpsc::Receiver<ArmMoment>) {
    let (sender, steps) = std::sync::mpsc::channel();
    let arm = ArmController::start_watched(ArmConfig::default(), move |moment| {
        // The receiver may be gone.
        let _ = sender.send(*moment);
    });
    (arm.expect("an arm"), steps)
}

fn expected(angles: [f32; 7]) -> [f64; 7] {
    angles.map(f64::from)
}

#[test]
fn feedback_tells_of_start_and_end() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(3));
    let number = client.post(&joint_move(AWAY, 2.0));
    assert_eq!(client.reply_to(number).status, Status::FINE);
    for kind in [FeedbackKind::Start, FeedbackKind::End] {
        let feedback = client.next_feedback();
        assert_eq!(
            (feedback.kind, feedback.transaction, feedback.register, feedback.result),
            (kind, number, 23, FeedbackResult::Done)
        );
    }
    assert!(distance(&arm.moment().joints, &expected(AWAY)) < 1e-6);
    // The mark at the end of an empty queue.
    let number = client.post(&Request::QueueMarker);
    client.reply_to(number);
    assert_eq!(client.next_feedback().transaction, number);
}

#[test]
fn old_firmware_tells_nothing_by_itself() {
    let arm = ArmController::start(of_firmware("v1.12.10")).expect("an arm");
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(3));
    client.fine(&joint_move(AWAY, 2.0));
    assert_eq!(client.state(), State::Moving);
    wait_for(&arm, "the end", is_done);
    assert_eq!(client.state(), State::Ready);
    assert!(client.feedback.is_empty());
    assert!(distance(&client.joints(), &expected(AWAY)) < 1e-6);
}

#[test]
fn speed_and_acceleration_of_a_joint_move_hold() {
    let (arm, steps) = watched();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(2));
    client.fine(&joint_move(AWAY, 0.8));
    client.next_feedback();
    let steps: Vec<ArmMoment> = steps.try_iter().collect();
    let fastest = steps.iter().map(|step| step.velocities[0].abs()).fold(0.0, f64::max);
    assert!((0.79..=0.8 + 1e-6).contains(&fastest), "{fastest}");
    for pair in steps.windows(2) {
        let change = distance(&pair[0].velocities, &pair[1].velocities);
        assert!(change <= 10.0 * 0.004 + 1e-9, "{} rad/s²", change / 0.004);
    }
}

#[test]
fn a_line_is_straight_and_as_fast_as_asked() {
    let (arm, steps) = watched();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    let from = client.pose();
    let mut to = from;
    (to[0], to[1], to[2]) = (from[0] - 60.0, from[1] + 150.0, from[2] + 40.0);
    client.fine(&Request::SetFeedback(2));
    client.fine(&line(to, 300.0));
    assert_eq!(client.next_feedback().result, FeedbackResult::Done);
    let pose = client.pose();
    for axis in 0..3 {
        assert!((pose[axis] - to[axis]).abs() < 0.01, "{pose:?} and {to:?}");
    }
    let [start, end] = [from, to].map(|pose| [0, 1, 2].map(|axis| f64::from(pose[axis]) / 1e3));
    let (start, end) = (
        geometry::nalgebra::Vector3::from(start),
        geometry::nalgebra::Vector3::from(end),
    );
    let along = (end - start).normalize();
    let places: Vec<_> = steps.try_iter().map(|step| step.base_from_flange).collect();
    let mut fastest: f64 = 0.0;
    for pair in places.windows(2) {
        let off = (pair[1].translation() - start).cross(&along).norm();
        assert!(off < 1e-5, "{off} m off the line");
        assert!(pair[1].rotation().angle_to(&places[0].rotation()) < 1e-5);
        fastest = fastest.max((pair[1].translation() - pair[0].translation()).norm() / 0.004);
    }
    assert!((fastest - 0.3).abs() < 1e-3, "{fastest} m/s");
}

#[test]
fn coordinates_can_stay_as_they_are() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(2));
    let from = client.pose();
    let mut pose = [xarm_protocol::KEEP; 6];
    pose[2] = from[2] + 50.0;
    client.fine(&line(pose, 200.0));
    client.next_feedback();
    let to = client.pose();
    assert!(
        (to[2] - from[2] - 50.0).abs() < 0.01 && (to[0] - from[0]).abs() < 0.01,
        "{to:?}"
    );
}

#[test]
fn a_line_in_the_tools_frame_goes_along_the_tool() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(2));
    let from = client.pose();
    let forward = MoveLine {
        pose: [0.0, 0.0, 30.0, 0.0, 0.0, 0.0],
        speed: 200.0,
        acceleration: 2000.0,
        time: 0.0,
        options: Some(MoveLineOptions {
            radius: -1.0,
            in_tool: true,
            axis_angle: true,
            check_only: false,
            motion_type: Some(0),
        }),
    };
    client.fine(&Request::MoveLine(forward));
    client.next_feedback();
    // The tool looks down.
    let to = client.pose();
    assert!(
        (to[2] - from[2] + 30.0).abs() < 0.1 && (to[0] - from[0]).abs() < 0.1,
        "{from:?} {to:?}"
    );
}

#[test]
fn corners_are_rounded_without_a_halt_or_a_jump() {
    let (arm, steps) = watched();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(2));
    let blended = |angles| {
        Request::MoveJoint(MoveJoint {
            angles,
            speed: 0.5,
            acceleration: 5.0,
            radius: Some(5.0),
            time: 0.0,
            check_only: None,
        })
    };
    let mut corner = HOME;
    corner[0] = 0.5;
    let mut end = corner;
    end[6] = 0.5;
    let numbers = [client.post(&blended(corner)), client.post(&joint_move(end, 0.5))];
    for number in numbers {
        client.reply_to(number);
    }
    for number in numbers {
        assert_eq!(client.next_feedback().transaction, number);
    }
    let steps: Vec<ArmMoment> = steps.try_iter().collect();
    let at_corner = steps
        .iter()
        .filter(|step| step.joints[0] > 0.45 && step.joints[6] < 0.05);
    let slowest = at_corner.map(|step| step.velocities[0].abs().max(step.velocities[6].abs()));
    assert!(slowest.fold(f64::INFINITY, f64::min) > 0.1, "it halts at the corner");
    for pair in steps.windows(2) {
        assert!(distance(&pair[0].velocities, &pair[1].velocities) < 10.0 * 0.004 + 1e-9);
    }
    assert!(distance(&arm.moment().joints, &expected(end)) < 1e-6);
}

#[test]
fn a_circle_ends_where_it_began() {
    let (arm, steps) = watched();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(2));
    let from = client.pose();
    let (mut through, mut to) = (from, from);
    // Centre 40 mm in x from here.
    (through[0], through[1]) = (from[0] + 40.0, from[1] + 40.0);
    to[0] = from[0] + 80.0;
    let circle = MoveCircle {
        through,
        to,
        speed: 200.0,
        acceleration: 2000.0,
        time: 0.0,
        percent: 100.0,
        options: None,
    };
    client.fine(&Request::MoveCircle(circle));
    assert_eq!(client.next_feedback().result, FeedbackResult::Done);
    let back = client.pose();
    assert!(
        (back[0] - from[0]).abs() < 0.01 && (back[1] - from[1]).abs() < 0.01,
        "{back:?}"
    );
    let centre = geometry::nalgebra::Vector2::new(f64::from(from[0]) / 1e3 + 0.04, f64::from(from[1]) / 1e3);
    for step in steps.try_iter() {
        let place = step.base_from_flange.translation();
        assert!(((place.xy() - centre).norm() - 0.04).abs() < 1e-5);
    }
}

#[test]
fn pausing_holds_and_running_goes_on() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&joint_move(AWAY, 0.5));
    wait_for(&arm, "speed", |moment| moment.velocities[0] > 0.4);
    client.fine(&Request::SetState(StateCommand::Pause));
    let held = wait_for(&arm, "rest", client::rests);
    assert_eq!((held.state, client.state()), (State::Paused, State::Paused));
    assert!(held.joints[0] < 0.59);
    client.fine(&Request::SetState(StateCommand::Run));
    let moment = wait_for(&arm, "the end", is_done);
    assert!(distance(&moment.joints, &expected(AWAY)) < 1e-6);
}

#[test]
fn decelerating_ends_stopped_with_an_empty_queue() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&joint_move(AWAY, 1.0));
    client.fine(&joint_move(HOME, 1.0));
    wait_for(&arm, "speed", |moment| moment.velocities[0] > 0.7);
    client.call(&Request::SetState(StateCommand::Decelerate));
    assert_eq!(client.state(), State::Decelerating);
    let moment = wait_for(&arm, "rest", client::rests);
    assert_eq!((moment.state, client.state()), (State::Stopped, State::Stopped));
    assert_eq!(client.call(&Request::GetQueued).data, [0, 0]);
}

#[test]
fn the_queue_holds_1024_commands() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::PauseTime(1000.0));
    for _ in 1..1024 {
        assert_eq!(client.call(&Request::PauseTime(1.0)).status, Status::FINE);
    }
    assert_eq!(client.call(&Request::GetQueued).data, 1024_u16.to_be_bytes());
    assert!(client.call(&joint_move(HOME, 1.0)).status.has(Status::WARNING));
    assert_eq!(client.error(), [0, 11]);
    assert_eq!(client.state(), State::Moving);
    client.call(&Request::SetState(StateCommand::Stop));
    assert_eq!(client.call(&Request::GetQueued).data, [0, 0]);
}

#[test]
fn a_move_can_be_checked_without_being_done() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    let before = client.joints();
    for (angles, result) in [(AWAY, 0), ([0.0, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0], 23)] {
        let check = MoveJoint {
            angles,
            speed: 1.0,
            acceleration: 10.0,
            radius: None,
            time: 0.0,
            check_only: Some(true),
        };
        assert_eq!(client.fine(&Request::MoveJoint(check)).data, [0, 0, result]);
    }
    assert_eq!((client.joints(), client.error()), (before, [0, 0]));
}

#[test]
fn a_move_that_is_not_obeyed_says_so() {
    let arm = start();
    let mut client = Client::connect(&arm);
    assert!(client.call(&joint_move(AWAY, 1.0)).status.has(Status::NOT_READY));
    client.enable(Mode::Servo);
    assert!(client.call(&joint_move(AWAY, 1.0)).status.has(Status::INVALID));
    client.enable(Mode::Position);
    assert!(client.call(&joint_move(AWAY, f32::NAN)).status.has(Status::INVALID));
    assert_eq!(client.call(&Request::GetQueued).data, [0, 0]);
}
