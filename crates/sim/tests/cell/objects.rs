//! Objects obey the cup, and the cameras see it.

use std::time::{Duration, Instant};

use geometry::nalgebra::{Point3, Vector3};
use sim::arm::ArmController;
use sim::cell::{Cell, ObjectState, Place};
use sim::world::World;

use super::arm::{ARM, enable, go, line_to, vacuum, wait_for};
use super::{Controller, PATIENCE, capture, open, start};

const OBJECTS: &str = "
cameras: {c1: {width: 80, height: 80}, c2: {width: 80, height: 80}}
objects:
  - {name: block, shape: {kind: box, size: [0.04, 0.04, 0.02]}, pose: {x: 0.4, y: -0.03}}
  - {name: plate, shape: {kind: plate, size: [0.05, 0.05, 0.008]}, pose: {x: 0.46, y: 0.04}}
";

fn world(arm: &str) -> World {
    World::from_yaml(&format!("{OBJECTS}{arm}"), "".as_ref()).expect("a world")
}

/// A cell with its arm enabled.
fn cell() -> Option<Cell> {
    let cell = start(world(ARM))?;
    enable(arm(&cell));
    Some(cell)
}

fn arm(cell: &Cell) -> &ArmController {
    cell.arm().expect("an arm")
}

/// Takes hold of the block and lifts it by 60 mm.
fn pick_block(cell: &Cell) {
    let arm = arm(cell);
    go(arm, &line_to(400.0, -30.0, 50.0));
    vacuum(arm, true);
    go(arm, &line_to(400.0, -30.0, 20.0));
    wait_for(arm, |moment| moment.held.is_some());
    let lifted = go(arm, &line_to(400.0, -30.0, 80.0));
    assert_eq!(lifted.error, 0, "{:?}", cell.collisions());
}

fn wait_for_object(cell: &Cell, name: &str, is_so: impl Fn(&ObjectState) -> bool) -> ObjectState {
    let end = Instant::now() + PATIENCE;
    loop {
        let objects = cell.objects();
        let object = objects
            .into_iter()
            .find(|object| object.name == name)
            .expect("an object");
        if is_so(&object) {
            return object;
        }
        assert!(Instant::now() < end, "{object:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !is_so() {
        assert!(Instant::now() < end, "{what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The cell's cameras are told where the arm is.
fn wait_until_followed(cell: &Cell) {
    wait_until("the cell does not follow", || {
        // What no pixel shows is not followed.
        let off = cell.world().base_from_flange.inverse() * arm(cell).moment().base_from_flange;
        off.translation().norm() < 2e-6 && off.rotation().angle() < 5e-6
    });
}

/// The middle of what C2 sees of a body (its number in the world as it is), pixels.
fn seen_by_c2(cell: &Cell, label: u8) -> Option<[f64; 2]> {
    cell.wait_until_rendered(PATIENCE).expect("views");
    let sight = cell.sight("c2").expect("a view");
    let labels = &sight.rendered.labels;
    let width = labels.width();
    let pixels = labels.pixels().iter().enumerate().filter(|(_, found)| **found == label);
    let places: Vec<[f64; 2]> = pixels
        .map(|(index, _)| [(index % width) as f64, (index / width) as f64])
        .collect();
    let mean = |axis: usize| places.iter().map(|place| place[axis]).sum::<f64>() / places.len() as f64;
    (!places.is_empty()).then(|| [mean(0), mean(1)])
}

fn on_c2(cell: &Cell, point: Vector3<f64>) -> [f64; 2] {
    let view = cell.sight("c2").expect("a view").view;
    let point = view.base_from_camera.inverse().transform_point(&Point3::from(point));
    let pixel = view.camera.project(&point).expect("before the camera");
    [pixel.x, pixel.y]
}

fn assert_near(found: [f64; 2], expected: [f64; 2]) {
    let off = (found[0] - expected[0]).hypot(found[1] - expected[1]);
    assert!(off < 2.5, "{found:?} is not {expected:?}");
}

#[test]
fn what_the_cup_holds_is_carried_and_seen_where_it_is() {
    let Some(cell) = cell() else { return };
    let before = seen_by_c2(&cell, 1).expect("the block is in sight");
    assert_near(before, on_c2(&cell, Vector3::new(0.4, -0.03, 0.01)));
    pick_block(&cell);
    go(arm(&cell), &line_to(430.0, -20.0, 80.0));
    wait_until_followed(&cell);
    let block = wait_for_object(&cell, "block", |block| block.place == Place::Held);
    let place = block.base_from_object.translation();
    assert!((place - Vector3::new(0.43, -0.02, 0.06)).norm() < 1e-4, "{place}");
    assert_eq!(
        block.base_from_object_at_start.translation(),
        Vector3::new(0.4, -0.03, 0.0)
    );
    let held = seen_by_c2(&cell, 1).expect("the block is in sight");
    assert_near(held, on_c2(&cell, Vector3::new(0.43, -0.02, 0.07)));

    vacuum(arm(&cell), false);
    let block = wait_for_object(&cell, "block", |block| block.place == Place::OnTable);
    let place = block.base_from_object.translation();
    assert!((place - Vector3::new(0.43, -0.02, 0.0)).norm() < 1e-4, "{place}");
    wait_until("the cameras are not told", || {
        cell.world().scene.bodies[0].base_from_body == block.base_from_object
    });
    let fallen = seen_by_c2(&cell, 1).expect("the block is in sight");
    assert_near(fallen, on_c2(&cell, Vector3::new(0.43, -0.02, 0.01)));
    assert_eq!(cell.collisions(), []);
}

#[test]
fn an_object_is_put_on_another_one() {
    let Some(cell) = cell() else { return };
    pick_block(&cell);
    go(arm(&cell), &line_to(460.0, 40.0, 80.0));
    vacuum(arm(&cell), false);
    let block = wait_for_object(&cell, "block", |block| block.place == Place::OnTable);
    let place = block.base_from_object.translation();
    assert!((place - Vector3::new(0.46, 0.04, 0.008)).norm() < 2e-4, "{place}");
}

#[test]
fn the_bin_takes_an_object_out_of_sight_and_another_world_brings_it_back() {
    let Some(cell) = cell() else { return };
    pick_block(&cell);
    go(arm(&cell), &line_to(400.0, -30.0, 200.0));
    go(arm(&cell), &line_to(180.0, 360.0, 200.0));
    assert!(cell.world().scene.bodies.iter().any(|body| body.name == "block"));
    vacuum(arm(&cell), false);
    wait_for_object(&cell, "block", |block| block.place == Place::InBin);
    wait_until("the cameras are not told", || cell.world().scene.bodies.len() == 1);
    assert_eq!(cell.world().scene.bodies[0].name, "plate");
    assert!(seen_by_c2(&cell, 1).is_some() && seen_by_c2(&cell, 2).is_none());

    cell.set_world(world(ARM)).expect("nothing on the network changes");
    let block = wait_for_object(&cell, "block", |block| block.place == Place::OnTable);
    assert_eq!(block.base_from_object, block.base_from_object_at_start);
    assert!(seen_by_c2(&cell, 1).is_some() && seen_by_c2(&cell, 2).is_some());
    assert_eq!(arm(&cell).moment().error, 0, "{:?}", cell.collisions());
}

#[test]
fn an_object_that_is_lost_under_way_lies_below_and_a_new_world_empties_the_cup() {
    let Some(cell) = cell() else { return };
    pick_block(&cell);
    arm(&cell).request(&line_to(400.0, 120.0, 80.0));
    wait_for(arm(&cell), |moment| moment.base_from_flange.translation().y > 0.05);
    arm(&cell).lose_object();
    let block = wait_for_object(&cell, "block", |block| block.place == Place::OnTable);
    let place = block.base_from_object.translation();
    assert!(place.z.abs() < 1e-6 && (0.05..0.12).contains(&place.y), "{place}");

    vacuum(arm(&cell), false);
    cell.set_world(world(ARM)).expect("nothing on the network changes");
    wait_for(arm(&cell), super::arm::is_done);
    pick_block(&cell);
    cell.set_world(world(ARM)).expect("nothing on the network changes");
    wait_for(arm(&cell), |moment| moment.held.is_none());
    let block = wait_for_object(&cell, "block", |block| block.place == Place::OnTable);
    assert_eq!(block.base_from_object, block.base_from_object_at_start);
}

#[test]
fn a_cup_that_is_pressed_on_is_a_collision_and_stops_the_arm() {
    let Some(cell) = cell() else { return };
    let arm = arm(&cell);
    go(arm, &line_to(400.0, -30.0, 40.0));
    // Where the lip gives way nothing happens.
    assert_eq!(go(arm, &line_to(400.0, -30.0, 17.0)).error, 0);
    assert_eq!(cell.collisions(), []);
    arm.request(&line_to(400.0, -30.0, 2.0));
    let stopped = wait_for(arm, |moment| moment.error != 0);
    assert_eq!(stopped.error, 31);
    let contacts = cell.collisions();
    assert_eq!(
        (contacts[0].link.as_str(), contacts[0].object.as_str()),
        ("cup", "block")
    );
    assert!(
        (0.005..0.018).contains(&contacts[0].depth) && contacts[0].micros > 0,
        "{contacts:?}"
    );
}

#[test]
fn an_arm_that_hits_something_may_be_counted_only() {
    let counting = ARM.replace("vacuum: 2", "vacuum: 2, collisions: count");
    let wall = "  - {name: wall, shape: {kind: box, size: [0.02, 0.1, 0.12]}, pose: {x: 0.55, y: -0.03}}\n";
    let world = World::from_yaml(&format!("{OBJECTS}{wall}{counting}"), "".as_ref()).expect("a world");
    let Some(cell) = start(world) else { return };
    let arm = arm(&cell);
    enable(arm);
    go(arm, &line_to(440.0, -30.0, 60.0));
    assert_eq!(cell.collisions(), []);
    // The gripper into the wall, and out again: one contact.
    let moment = go(arm, &line_to(510.0, -30.0, 60.0));
    assert_eq!(moment.error, 0);
    go(arm, &line_to(440.0, -30.0, 60.0));
    let contacts = cell.collisions();
    assert!(contacts.iter().all(|contact| contact.object == "wall"), "{contacts:?}");
    assert!(
        contacts.iter().any(|contact| contact.link == "vacuum_gripper"),
        "{contacts:?}"
    );
    let deepest = contacts.iter().map(|contact| contact.depth).fold(0.0, f64::max);
    assert!((0.004..0.03).contains(&deepest), "{contacts:?}");
}

#[test]
fn after_a_pick_the_cameras_are_ready_when_the_arm_comes_back() {
    let Some(cell) = cell() else { return };
    let home = arm(&cell).moment().joints.map(|angle| angle as f32);
    let home = super::arm::joint_move(home);
    go(arm(&cell), &home);
    wait_until_followed(&cell);
    let mut controller = Controller::open(cell.board().port());
    let mut cameras = open(&cell);
    let before = capture(&mut cameras, &mut controller);
    let full = cell.sight("c1").expect("a view");

    pick_block(&cell);
    go(arm(&cell), &line_to(400.0, -30.0, 200.0));
    go(arm(&cell), &line_to(180.0, 360.0, 200.0));
    vacuum(arm(&cell), false);
    wait_for_object(&cell, "block", |block| block.place == Place::InBin);
    wait_until("nothing is rendered ahead", || cell.is_prepared());
    go(arm(&cell), &home);
    wait_until_followed(&cell);
    // Not rendered now: that begins only when the arm has been still for a while.
    let empty = cell.sight("c1").expect("the view was ready");
    let has_second = |sight: &sim::cell::Sight| sight.rendered.labels.pixels().contains(&2);
    assert!(has_second(&full) && !has_second(&empty), "one object is left");
    let after = capture(&mut cameras, &mut controller);
    for (before, after) in before.iter().zip(&after) {
        assert_eq!(after.len(), 8);
        assert!(before[1] != after[1], "the block is gone");
    }
}

#[test]
fn an_arm_that_comes_back_to_an_unchanged_world_finds_its_view_again() {
    let Some(cell) = cell() else { return };
    let home = arm(&cell).moment().joints.map(|angle| angle as f32);
    go(arm(&cell), &super::arm::joint_move(home));
    wait_until_followed(&cell);
    cell.wait_until_rendered(PATIENCE).expect("views");
    let views = ["c1", "c2"].map(|name| cell.sight(name).expect("a view"));
    let mut away = home;
    away[0] += 0.2;
    go(arm(&cell), &super::arm::joint_move(away));
    cell.wait_until_rendered(PATIENCE).expect("views");
    go(arm(&cell), &super::arm::joint_move(home));
    wait_until_followed(&cell);
    let again = ["c1", "c2"].map(|name| cell.sight(name).expect("it is there at once"));
    for (view, again) in views.iter().zip(&again) {
        assert!(std::sync::Arc::ptr_eq(view, again));
    }
}
