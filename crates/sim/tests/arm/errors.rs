//! Errors, and the ways out of them.

use client::{Client, is_done, joint_move, line, start, wait_for};
use sim::arm::EmergencyStop;
use xarm_protocol::{FeedbackKind, FeedbackResult, Mode, Request, State, StateCommand, Status, controller_errors};

use crate::client;

const AWAY: [f32; 7] = [1.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

#[test]
fn every_error_stops_the_arm_and_has_a_way_out() {
    let arm = start();
    let mut client = Client::connect(&arm);
    for (round, fault) in controller_errors().iter().enumerate() {
        client.enable(Mode::JointVelocity);
        arm.raise_error(fault.code);
        assert_eq!(client.error(), [fault.code, 0]);
        let moment = arm.moment();
        assert_eq!((moment.mode, moment.state), (Mode::Position, State::Stopped));
        // No step of the sequence may be left out.
        client.call(&Request::SetState(StateCommand::Run));
        assert_eq!(client.state(), State::Stopped, "round {round}: with an error");
        client.call(&Request::CleanError);
        client.call(&Request::SetState(StateCommand::Run));
        assert_eq!(client.state(), State::Stopped, "round {round}: without motors");
    }
    client.enable(Mode::Position);
    client.fine(&joint_move(AWAY, 3.0));
    wait_for(&arm, "the move after all errors", |moment| {
        moment.joints[0] > 0.999 && is_done(moment)
    });
}

#[test]
fn an_error_in_a_move_brakes_discards_and_tells() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(2));
    let numbers = [
        client.post(&joint_move(AWAY, 0.5)),
        client.post(&joint_move([0.0; 7], 0.5)),
    ];
    for number in numbers {
        client.reply_to(number);
    }
    wait_for(&arm, "full speed", |moment| moment.velocities[0] > 0.49);
    arm.raise_error(31);
    for number in numbers {
        let feedback = client.next_feedback();
        assert_eq!(
            (feedback.transaction, feedback.kind, feedback.result),
            (number, FeedbackKind::End, FeedbackResult::Discarded)
        );
    }
    let moment = wait_for(&arm, "rest", client::rests);
    assert!(moment.joints[0] < 0.9, "it did not finish the move");
    assert_eq!(client.call(&Request::GetQueued).data, [0, 0]);
    client.enable(Mode::Position);
    client.fine(&joint_move(AWAY, 2.0));
    wait_for(&arm, "the move", |moment| moment.joints[0] > 0.999);
}

#[test]
fn a_pressed_button_cannot_be_cleaned() {
    for (stop, code) in [(EmergencyStop::Button, 1), (EmergencyStop::Input, 2)] {
        let arm = start();
        let mut client = Client::connect(&arm);
        client.enable(Mode::Position);
        arm.press(stop);
        assert_eq!(client.error(), [code, 0]);
        client.call(&Request::CleanError);
        let reply = client.call(&Request::MotionEnable { axis: 8, on: true });
        assert!(reply.status.has(Status::ERROR));
        assert_eq!(client.error(), [code, 0], "still pressed");
        arm.release();
        assert_eq!(client.error(), [code, 0], "released, not cleaned");
        client.enable(Mode::Position);
        assert_eq!((client.error(), client.state()), ([0, 0], State::Ready));
    }
}

#[test]
fn motions_that_cannot_be_are_errors_of_their_own() {
    let cases = [
        (23, joint_move([0.0, 2.5, 0.0, 1.0, 0.0, 0.0, 0.0], 1.0)),
        (40, line([1500.0, 0.0, 300.0, 3.0, 0.0, 0.0], 100.0)),
    ];
    for (code, request) in cases {
        let arm = start();
        let mut client = Client::connect(&arm);
        client.enable(Mode::Position);
        client.fine(&Request::SetFeedback(2));
        client.fine(&request);
        assert_eq!(client.next_feedback().result, FeedbackResult::Failed);
        assert_eq!(client.error(), [code, 0]);
    }
}

#[test]
fn the_arm_does_not_touch_itself() {
    let arm = start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    // Folded, the gripper into the base.
    let folded = [0.0, -0.4, 0.0, -0.1, 0.0, 1.1, 0.0];
    client.fine(&joint_move(folded, 3.0));
    let moment = wait_for(&arm, "the error", |moment| moment.error != 0 && client::rests(moment));
    assert_eq!(moment.error, 22);
    // Back out of it.
    client.enable(Mode::Position);
    client.fine(&joint_move(AWAY, 3.0));
    assert_eq!(
        wait_for(&arm, "the way back", |moment| moment.error != 0 || is_done(moment)).error,
        0
    );
}

#[test]
fn servo_errors_are_told_by_joint() {
    let arm = start();
    let mut client = Client::connect(&arm);
    arm.raise_error(13);
    let codes = client.call(&Request::ServoDebug).data;
    assert_eq!((codes.len(), &codes[4..6]), (16, &[3, 23][..]));
}
