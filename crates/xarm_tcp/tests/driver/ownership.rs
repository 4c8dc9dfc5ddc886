//! Other clients of the controller.

use devices::{Arm, ArmCondition, StreamFault};
use xarm_protocol::{Mode, Request, State, StateCommand};

use crate::rig::{PATIENCE, Rig, Sender};

async fn interfere(requests: &[Request]) -> Rig {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, PATIENCE);
    rig.wait_for_condition(ArmCondition::Moving).await;
    for request in requests {
        rig.controller.request(request);
    }
    let fault = sender.end().await.fault;
    // What is seen first: the answer to a set-point, or the report.
    assert!(
        matches!(fault, Some(StreamFault::NotReady | StreamFault::Refused)),
        "{fault:?}"
    );
    rig.wait_for(|state| !matches!(state.condition, ArmCondition::Armed | ArmCondition::Moving))
        .await;
    rig
}

#[tokio::test(flavor = "multi_thread")]
async fn a_mode_that_another_client_took_is_not_taken_back() {
    let rig = interfere(&[Request::SetMode(Mode::Position), Request::SetState(StateCommand::Run)]).await;
    rig.wait_for_condition(ArmCondition::Disarmed).await;
    let moment = rig.controller.moment();
    assert_eq!((moment.mode, moment.state), (Mode::Position, State::Ready));
    let why = rig.arm.statistics().last_stream_end.expect("a stream ended");
    assert!(why.contains("another client"), "{why}");
    // Only when asked.
    rig.armed().await;
    assert_eq!(rig.controller.moment().mode, Mode::Servo);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_by_another_client_stays() {
    let rig = interfere(&[Request::SetState(StateCommand::Stop)]).await;
    rig.wait_for_condition(ArmCondition::Stopped).await;
    assert_eq!(rig.controller.moment().state, State::Stopped);
    let why = rig.arm.statistics().last_stream_end.expect("a stream ended");
    assert!(why.contains("another client"), "{why}");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_arm_in_free_drive_can_be_armed() {
    let rig = Rig::connected().await;
    rig.arm.recover(false).await.expect("there is nothing in the way");
    rig.controller.request(&Request::SetMode(Mode::FreeDrive));
    rig.controller.request(&Request::SetState(StateCommand::Run));
    rig.wait_for_condition(ArmCondition::Disarmed).await;
    rig.armed().await;
    assert_eq!(rig.controller.moment().mode, Mode::Servo);
}
