//! Errors of the controller, and the ways out.

use std::time::Duration;

use devices::{Arm, ArmCondition, ArmError, ArmFault, FaultRecovery, StreamFault};
use sim::arm::EmergencyStop;
use xarm_protocol::Mode;

use crate::rig::{PATIENCE, Rig, Sender};

async fn fault(rig: &Rig) -> ArmFault {
    let state = rig
        .wait_for(|state| matches!(state.condition, ArmCondition::Fault(_)))
        .await;
    match state.condition {
        ArmCondition::Fault(fault) => fault,
        other => panic!("{other:?}"),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_collision_is_recovered_once_somebody_has_looked() {
    let rig = Rig::connected().await;
    let sender = Sender::start(rig.armed().await, PATIENCE);
    rig.wait_for_condition(ArmCondition::Moving).await;
    rig.controller.raise_error(31);
    assert_eq!(sender.end().await.fault, Some(StreamFault::ControllerError));
    let fault = fault(&rig).await;
    assert_eq!((fault.code, fault.recovery), (31, FaultRecovery::AfterLook));
    assert!(fault.description.contains("collision"), "{}", fault.description);
    assert!(matches!(rig.arm.arm().await.err(), Some(ArmError::Fault(found)) if found == fault));
    let refused = rig.arm.recover(false).await.expect_err("nobody has looked");
    assert!(refused.to_string().contains("has to look"), "{refused}");
    assert_eq!(rig.controller.moment().error, 31);
    rig.arm.recover(true).await.expect("somebody has looked");
    rig.wait_for_condition(ArmCondition::Disarmed).await;
    assert_eq!(
        (rig.controller.moment().error, rig.controller.moment().mode),
        (0, Mode::Position)
    );
    let again = Sender::start(rig.armed().await, Duration::from_millis(200)).end().await;
    assert_eq!((again.fault, again.count), (None, 50));
}

#[tokio::test(flavor = "multi_thread")]
async fn an_emergency_stop_is_for_a_person_to_end() {
    for (button, code) in [(EmergencyStop::Button, 1), (EmergencyStop::Input, 2)] {
        let rig = Rig::connected().await;
        let _stream = rig.armed().await;
        rig.controller.press(button);
        let found = fault(&rig).await;
        assert_eq!((found.code, found.recovery), (code, FaultRecovery::Person));
        let held = rig.arm.recover(true).await;
        assert!(
            matches!(&held, Err(ArmError::Fault(still)) if still.code == code),
            "{held:?}"
        );
        rig.controller.release();
        rig.arm.recover(false).await.expect("it was released");
        rig.wait_for_condition(ArmCondition::Disarmed).await;
        rig.armed().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_error_of_a_servo_tells_what_the_servo_says() {
    let rig = Rig::connected().await;
    rig.controller.raise_error(13);
    let found = fault(&rig).await;
    assert!(
        found
            .description
            .contains("Servo of joint 3, code 23: the joint is far from its commanded position"),
        "{}",
        found.description
    );
    assert_eq!(found.recovery, FaultRecovery::AfterLook);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_needs_no_person_is_recovered_at_once() {
    let rig = Rig::connected().await;
    rig.controller.raise_error(24);
    rig.controller.raise_warning(11);
    assert_eq!(fault(&rig).await.recovery, FaultRecovery::Automatic);
    rig.arm.recover(false).await.expect("it is automatic");
    assert_eq!((rig.controller.moment().error, rig.controller.moment().warning), (0, 0));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_only_the_maker_can_repair_is_refused() {
    let rig = Rig::connected().await;
    rig.controller.raise_error(39);
    assert_eq!(fault(&rig).await.recovery, FaultRecovery::Service);
    let refused = rig.arm.recover(true).await.expect_err("it does not help");
    assert!(refused.to_string().contains("power board"), "{refused}");
    assert_eq!(rig.controller.moment().error, 39);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_arm_without_a_fault_can_be_recovered_too() {
    let rig = Rig::connected().await;
    rig.arm.recover(false).await.expect("there is nothing in the way");
    rig.wait_for_condition(ArmCondition::Disarmed).await;
}
