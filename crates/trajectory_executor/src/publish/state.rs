//! `arm/state`.

use devices::{ArmCondition, ArmLink, ArmState, SuctionState};
use interfaces::builtin_interfaces::msg::Duration as DurationMessage;
use interfaces::geometry_msgs::msg::{Twist, Vector3};
use interfaces::rakelight_msgs::msg::ArmState as Message;
use nalgebra::SVector;

use crate::convert::pose_message;
use crate::executor::{Executor, Standing};

pub(super) fn message(executor: &Executor, standing: &Standing, arm: &ArmState, vacuum: SuctionState) -> Message {
    let (error_code, fault) = fault(standing, arm);
    let mut message = Message {
        mode: mode(standing, arm),
        vacuum: match (vacuum.on, vacuum.held) {
            (false, _) => Message::VACUUM_OFF,
            (true, false) => Message::VACUUM_ON,
            (true, true) => Message::VACUUM_HELD,
        },
        error_code,
        fault,
        control_period: DurationMessage::try_from(executor.remote().take_longest_period()).unwrap_or_default(),
        missed_deadlines: executor.remote().timing().missed,
        ..Message::default()
    };
    place_tool(executor, arm, &mut message);
    message
}

fn mode(standing: &Standing, arm: &ArmState) -> u8 {
    match (&arm.link, &arm.condition, standing) {
        (ArmLink::Disconnected { .. }, _, _) => Message::DISCONNECTED,
        (_, ArmCondition::Fault(_), _) => Message::FAULT,
        (_, _, Standing::Moving) => Message::MOVING,
        (_, _, Standing::Stopping { .. }) => Message::STOPPING,
        (_, _, Standing::Stopped { .. } | Standing::Lost { .. }) => Message::STOPPED,
        (_, _, Standing::Ready) => Message::READY,
        (_, _, Standing::Disarmed) => Message::DISABLED,
    }
}

fn fault(standing: &Standing, arm: &ArmState) -> (i32, String) {
    match (&arm.link, &arm.condition, standing) {
        (ArmLink::Disconnected { reason }, _, _) => (0, reason.clone()),
        (_, ArmCondition::Fault(fault), _) => (i32::from(fault.code), fault.description.clone()),
        (_, _, Standing::Stopped { reason } | Standing::Lost { reason }) => (0, reason.clone()),
        _ => (0, String::new()),
    }
}

fn place_tool(executor: &Executor, arm: &ArmState, message: &mut Message) {
    let Some(joints) = &arm.joints else {
        return;
    };
    let chain = &executor.model().chain;
    let Ok((pose, jacobian)) = chain.jacobian(&SVector::from(joints.angles)) else {
        return;
    };
    let twist = jacobian * SVector::from(joints.velocities);
    let vector = |first: usize| Vector3 {
        x: twist[first],
        y: twist[first + 1],
        z: twist[first + 2],
    };
    message.tcp = pose_message(&pose);
    message.tcp_velocity = Twist {
        linear: vector(0),
        angular: vector(3),
    };
}
