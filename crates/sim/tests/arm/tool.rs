//! Tool board and vacuum gripper.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use client::{Client, joint_move, wait_for};
use geometry::RigidTransform;
use sim::arm::{ArmConfig, ArmController, ArmFaults, SuctionWorld};
use xarm_protocol::{FeedbackKind, Mode, Request, VacuumHardware, tool_address};

use crate::client;

/// Something of 0.4 kg is before the cup, or not.
#[derive(Debug, Default)]
struct Plate(AtomicBool);

impl SuctionWorld for Plate {
    fn touched(&self, base_from_cup: &RigidTransform) -> Option<f64> {
        // The flange is at z = 0.374 and looks down.
        assert!((base_from_cup.translation().z - (0.374_027 - 0.126)).abs() < 1e-5);
        self.0.load(Ordering::Relaxed).then_some(0.4)
    }
}

fn arm_over(plate: &Arc<Plate>, vacuum: VacuumHardware) -> ArmController {
    let suction: Arc<dyn SuctionWorld> = plate.clone();
    let config = ArmConfig {
        vacuum,
        suction: Some(suction),
        ..ArmConfig::default()
    };
    ArmController::start(config).expect("an arm")
}

fn write(value: u16, in_queue: Option<bool>) -> Request {
    Request::ToolWrite {
        address: tool_address::SET_OUTPUTS,
        value: f32::from(value),
        in_queue,
    }
}

fn read(client: &mut Client, address: u16) -> i32 {
    client
        .call(&Request::ToolRead { address })
        .read_integer()
        .expect("a number")
}

fn switch(client: &mut Client, vacuum: VacuumHardware, on: bool) {
    for value in vacuum.writes(on) {
        client.call(&write(value, None));
    }
}

#[test]
fn both_versions_hold_and_let_go() {
    for vacuum in [VacuumHardware::Cable, VacuumHardware::Contacts] {
        let plate = Arc::new(Plate::default());
        let arm = arm_over(&plate, vacuum);
        let mut client = Client::connect(&arm);
        client.enable(Mode::Position);
        let idle = client
            .call(&Request::GetJointTorques)
            .read_floats::<7>()
            .expect("seven");
        switch(&mut client, vacuum, true);
        assert!(vacuum.is_on(read(&mut client, tool_address::OUTPUTS)));
        assert!(
            !vacuum.is_held(read(&mut client, tool_address::INPUTS)),
            "there is nothing"
        );
        plate.0.store(true, Ordering::Relaxed);
        wait_for(&arm, "a seal", |moment| moment.held == Some(0.4));
        assert!(vacuum.is_held(read(&mut client, tool_address::INPUTS)));
        let held = client
            .call(&Request::GetJointTorques)
            .read_floats::<7>()
            .expect("seven");
        assert!((held[1] - idle[1]).abs() > 1.0, "0.4 kg are felt in the shoulder");
        plate.0.store(false, Ordering::Relaxed);
        switch(&mut client, vacuum, false);
        wait_for(&arm, "letting go", |moment| moment.held.is_none());
        assert!(!vacuum.is_on(read(&mut client, tool_address::OUTPUTS)));
        assert!(!vacuum.is_held(read(&mut client, tool_address::INPUTS)));
    }
}

#[test]
fn the_wrong_version_stays_silent() {
    let plate = Arc::new(Plate(AtomicBool::new(true)));
    let arm = arm_over(&plate, VacuumHardware::Contacts);
    let mut client = Client::connect(&arm);
    switch(&mut client, VacuumHardware::Cable, true);
    let micros = arm.moment().micros;
    let moment = wait_for(&arm, "half a second", |moment| moment.micros > micros + 500_000);
    assert_eq!(moment.held, None);
}

#[test]
fn outputs_wait_for_motions_unless_they_are_not_to() {
    let arm = client::start();
    let mut client = Client::connect(&arm);
    client.enable(Mode::Position);
    client.fine(&Request::SetFeedback(6));
    let [pump, vent] = VacuumHardware::Cable.writes(true);
    let move_number = client.post(&joint_move([0.5, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0], 1.0));
    client.reply_to(move_number);
    let queued = client.post(&write(pump, None));
    client.reply_to(queued);
    assert_eq!(read(&mut client, tool_address::OUTPUTS), 0, "it waits");
    let at_once = client.post(&write(vent | 2, Some(false)));
    client.reply_to(at_once);
    assert_eq!(read(&mut client, tool_address::OUTPUTS), 2, "this one does not");
    let order: Vec<_> = (0..3)
        .map(|_| client.next_feedback())
        .map(|told| (told.transaction, told.kind))
        .collect();
    let expected = [
        (at_once, FeedbackKind::Triggered),
        (move_number, FeedbackKind::End),
        (queued, FeedbackKind::Triggered),
    ];
    assert_eq!(order, expected);
    assert_eq!(read(&mut client, tool_address::OUTPUTS), 3);
}

#[test]
fn seals_fail_and_objects_fall_on_demand() {
    let plate = Arc::new(Plate(AtomicBool::new(true)));
    let arm = arm_over(&plate, VacuumHardware::Cable);
    let mut client = Client::connect(&arm);
    arm.set_faults(ArmFaults {
        never_seals: true,
        ..ArmFaults::default()
    });
    switch(&mut client, VacuumHardware::Cable, true);
    let micros = arm.moment().micros;
    let moment = wait_for(&arm, "half a second", |moment| moment.micros > micros + 500_000);
    assert_eq!(moment.held, None);
    arm.set_faults(ArmFaults::default());
    wait_for(&arm, "a seal", |moment| moment.held.is_some());
    arm.lose_object();
    assert!(!VacuumHardware::Cable.is_held(read(&mut client, tool_address::INPUTS)));
    let micros = arm.moment().micros;
    let moment = wait_for(&arm, "half a second", |moment| moment.micros > micros + 500_000);
    assert_eq!(moment.held, None, "it fell");
}
