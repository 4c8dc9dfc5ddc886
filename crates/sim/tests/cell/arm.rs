//! The arm in the cell: it carries C1, and its cup takes hold of what lies on the table.

use std::time::{Duration, Instant};

use geometry::nalgebra::{UnitQuaternion, Vector3};
use sim::arm::{ArmController, ArmMoment};
use sim::world::World;
use xarm_protocol::{Mode, MoveJoint, MoveLine, Request, State, StateCommand, VacuumHardware, tool_address};

use super::{PATIENCE, start, world};

pub(crate) const ARM: &str = "arm: {control_port: 0, report_ports: [0, 0, 0], vacuum: 2}\n";

pub(crate) fn wait_for(arm: &ArmController, is_so: impl Fn(&ArmMoment) -> bool) -> ArmMoment {
    let end = Instant::now() + PATIENCE;
    loop {
        let moment = arm.moment();
        if is_so(&moment) {
            return moment;
        }
        assert!(Instant::now() < end, "{moment:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

pub(crate) fn is_done(moment: &ArmMoment) -> bool {
    moment.state == State::Ready && moment.velocities.iter().all(|velocity| velocity.abs() < 1e-9)
}

pub(crate) fn enable(arm: &ArmController) {
    arm.request(&Request::MotionEnable { axis: 8, on: true });
    arm.request(&Request::SetMode(Mode::Position));
    arm.request(&Request::SetState(StateCommand::Run));
}

pub(crate) fn go(arm: &ArmController, request: &Request) -> ArmMoment {
    arm.request(request);
    wait_for(arm, is_done)
}

#[test]
fn the_arm_moves_the_camera_that_it_carries() {
    let Some(cell) = start(world(ARM)) else { return };
    let arm = cell.arm().expect("an arm");
    assert_eq!(cell.world().base_from_flange, arm.moment().base_from_flange);
    enable(arm);
    let mut angles = arm.moment().joints.map(|angle| angle as f32);
    angles[0] += 0.1;
    let moment = go(arm, &joint_move(angles));
    assert_eq!(moment.error, 0);
    let end = Instant::now() + PATIENCE;
    while cell.world().base_from_flange != moment.base_from_flange {
        assert!(Instant::now() < end, "the cell does not follow");
        std::thread::sleep(Duration::from_millis(5));
    }
    // Another world does not move the arm back.
    let mut other = world(ARM);
    other.scene.bodies.clear();
    cell.set_world(other).expect("nothing on the network changes");
    assert_eq!(cell.world().base_from_flange, arm.moment().base_from_flange);
    let error = cell.set_world(world("")).expect_err("the arm stays").to_string();
    assert!(error.starts_with("arm is None"), "{error}");
}

pub(crate) fn joint_move(angles: [f32; 7]) -> Request {
    Request::MoveJoint(MoveJoint {
        angles,
        speed: 1.0,
        acceleration: 10.0,
        radius: None,
        time: 0.0,
        check_only: None,
    })
}

/// Pump on, or off with the vent open.
pub(crate) fn vacuum(arm: &ArmController, on: bool) {
    for value in VacuumHardware::Contacts.writes(on) {
        let address = tool_address::SET_OUTPUTS;
        arm.request(&Request::ToolWrite {
            address,
            value: f32::from(value),
            in_queue: None,
        });
    }
}

/// On a straight line, with the cup's mouth (mm) there and looking down.
pub(crate) fn line_to(x: f32, y: f32, z: f32) -> Request {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI).euler_angles();
    Request::MoveLine(MoveLine {
        pose: [x, y, z + 126.0, down.0 as f32, 0.0, 0.0],
        speed: 200.0,
        acceleration: 2000.0,
        time: 0.0,
        options: None,
    })
}

/// With the cup's mouth so far above a block's top.
fn over_block(height: f32) -> Request {
    line_to(400.0, 0.0, 40.0 + height)
}

#[test]
fn the_cup_takes_hold_of_an_object() {
    let yaml = "
cameras: {c1: {width: 80, height: 80}, c2: {width: 80, height: 80}}
objects: [{name: block, shape: {kind: octagon2, width: 0.08, height: 0.04}, pose: {x: 0.4}}]
";
    let world = World::from_yaml(&format!("{yaml}{ARM}"), "".as_ref()).expect("a world");
    let Some(cell) = start(world) else { return };
    let arm = cell.arm().expect("an arm");
    enable(arm);
    vacuum(arm, true);
    let above = go(arm, &over_block(30.0));
    assert_eq!((above.error, above.held), (0, None));
    go(arm, &over_block(0.0));
    let held = wait_for(arm, |moment| moment.held.is_some());
    assert!(held.held.is_some_and(|mass| (0.02..0.5).contains(&mass)), "{held:?}");
}
