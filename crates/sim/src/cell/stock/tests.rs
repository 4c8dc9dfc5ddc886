use std::f64::consts::PI;
use std::path::Path;

use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};

use super::*;
use crate::world::Bin;

fn stock(objects: &str) -> Stock {
    let world = World::from_yaml(&format!("objects: [{objects}]"), Path::new("")).expect("a world");
    Stock::new(&world).expect("meshes")
}

/// Of a cup that looks down.
fn cup(x: f64, y: f64, z: f64) -> RigidTransform {
    tilted(x, y, z, 0.0)
}

fn tilted(x: f64, y: f64, z: f64, tilt: f64) -> RigidTransform {
    RigidTransform::from_parts(
        Vector3::new(x, y, z),
        UnitQuaternion::from_euler_angles(PI + tilt, 0.0, 0.0),
    )
}

/// Takes hold, goes there, lets go.
fn carry(stock: &Stock, from: &RigidTransform, to: &RigidTransform) {
    assert!(stock.touched(from).is_some(), "nothing to take hold of");
    stock.sealed(from);
    stock.follow(from);
    stock.follow(to);
    stock.released(to);
    stock.follow(to);
}

fn object(stock: &Stock, name: &str) -> ObjectState {
    let objects = stock.objects(None);
    objects
        .into_iter()
        .find(|object| object.name == name)
        .expect("it is there")
}

fn place(stock: &Stock, name: &str) -> (Place, Vector3<f64>) {
    let object = object(stock, name);
    (object.place, object.base_from_object.translation())
}

const BLOCK: &str = "{name: block, shape: {kind: box, size: [0.04, 0.03, 0.02]}, pose: {x: 0.4}}";
const PLATE: &str = "{name: plate, shape: {kind: plate, size: [0.06, 0.06, 0.008]}, pose: {x: 0.5, y: 0.1}}";

#[test]
fn a_rim_that_lies_on_an_object_seals() {
    let octagon = "{shape: {kind: octagon2, width: 0.09, height: 0.029}, pose: {x: 0.4, y: 0.1}}";
    let stock = stock(octagon);
    let touched = |shift: [f64; 3], tilt: f64| {
        let [x, y, z] = shift;
        stock.touched(&tilted(0.4 + x, 0.1 + y, 0.029 + z, tilt))
    };
    for height in [-0.002, 0.0, 0.002] {
        let mass = touched([0.0, 0.0, height], 0.0).expect("a seal");
        // Some 9 cm by 3 cm of plastic.
        assert!((0.05..0.3).contains(&mass), "{mass} kg");
    }
    assert!(touched([0.0; 3], 0.1).is_some(), "1 mm at the rim is given way to");
    assert_eq!(touched([0.0, 0.0, 0.004], 0.0), None, "in the air");
    assert_eq!(touched([0.0, 0.0, -0.004], 0.0), None, "too deep");
    assert_eq!(touched([0.05, 0.0, 0.0], 0.0), None, "over an edge");
    assert_eq!(touched([0.0; 3], 0.4), None, "tilted");
}

#[test]
fn a_rim_on_two_objects_or_beside_a_thin_one_does_not_seal() {
    let left = "{shape: {kind: box, size: [0.04, 0.04, 0.02]}, pose: {x: 0.38}}";
    let right = "{shape: {kind: box, size: [0.04, 0.04, 0.02]}, pose: {x: 0.42}}";
    assert_eq!(stock(&format!("{left}, {right}")).touched(&cup(0.4, 0.0, 0.02)), None);
    // The plate under the disc is within reach of a cup that is pressed on the disc, and is not what it holds.
    let plate = "{shape: {kind: base_plate, size: [0.1, 0.1, 0.003]}, pose: {x: 0.4}}";
    let disc = "{name: disc, shape: {kind: disc, height: 0.00315}, pose: {x: 0.4, z: 0.003}}";
    let stock = stock(&format!("{plate}, {disc}"));
    let mass = stock.touched(&cup(0.4, 0.0, 0.00515)).expect("a seal");
    assert!((mass - 1200.0 * PI * 0.025 * 0.025 * 0.00315).abs() < 1e-5, "{mass} kg");
    assert_eq!(stock.touched(&cup(0.42, 0.0, 0.00515)), None, "half beside the disc");
}

#[test]
fn what_the_cup_holds_moves_with_it_as_one_piece() {
    let stock = stock(BLOCK);
    let (seal, there) = (cup(0.405, 0.003, 0.019), tilted(0.3, 0.2, 0.3, 0.5));
    stock.sealed(&seal);
    stock.follow(&there);
    let object = object(&stock, "block");
    assert_eq!(object.place, Place::Held);
    let expected = there * seal.inverse() * object.base_from_object_at_start;
    let off = expected.inverse() * object.base_from_object;
    assert!(off.translation().norm() < 1e-12 && off.rotation().angle() < 1e-12);
    assert!(
        stock
            .inventory()
            .places_without_held()
            .is_some_and(|places| places.is_empty())
    );
}

#[test]
fn what_is_let_go_falls_on_the_table() {
    let stock = stock(BLOCK);
    carry(&stock, &cup(0.4, 0.0, 0.02), &cup(0.45, -0.1, 0.2));
    let (place, at) = place(&stock, "block");
    assert_eq!(place, Place::OnTable);
    assert!((at - Vector3::new(0.45, -0.1, 0.0)).norm() < 1e-6, "{at}");
}

#[test]
fn what_falls_tilted_lies_flat_on_the_face_that_was_nearest_to_the_table() {
    let stock = stock(BLOCK);
    carry(&stock, &cup(0.4, 0.0, 0.02), &tilted(0.45, -0.1, 0.2, 0.3));
    let object = object(&stock, "block");
    let up = object.base_from_object.transform_direction(&Vector3::z());
    assert!((up - Vector3::z()).norm() < 1e-6, "{up}");
    assert!(object.base_from_object.translation().z.abs() < 1e-6);
    // On its side, 30 mm high.
    let upright = object.base_from_object.translation();
    carry(&stock, &cup(upright.x, upright.y, 0.02), &tilted(0.45, -0.1, 0.2, 1.3));
    let side = self::object(&stock, "block").base_from_object;
    assert!(side.transform_direction(&Vector3::z()).z.abs() < 1e-6);
    let centre = side.transform_point(&Point3::new(0.0, 0.0, 0.01));
    assert!((centre.z - 0.015).abs() < 1e-6, "{centre}");
}

#[test]
fn what_falls_on_another_object_stays_there() {
    let stock = stock(&format!("{BLOCK}, {PLATE}"));
    carry(&stock, &cup(0.4, 0.0, 0.02), &cup(0.5, 0.1, 0.2));
    let (place, at) = place(&stock, "block");
    assert_eq!(place, Place::OnTable);
    assert!((at - Vector3::new(0.5, 0.1, 0.008)).norm() < 1e-6, "{at}");
}

#[test]
fn what_lies_on_a_held_object_rides_along() {
    let stock = stock(&format!("{BLOCK}, {PLATE}"));
    carry(&stock, &cup(0.4, 0.0, 0.02), &cup(0.515, 0.1, 0.2));
    // Beside the block, on the plate.
    let seal = cup(0.481, 0.1, 0.008);
    stock.sealed(&seal);
    stock.follow(&seal);
    stock.follow(&cup(0.481, 0.2, 0.108));
    let (place_of_rider, at) = place(&stock, "block");
    assert_eq!((place_of_rider, place(&stock, "plate").0), (Place::Held, Place::Held));
    assert!((at - Vector3::new(0.515, 0.2, 0.108)).norm() < 1e-6, "{at}");
    stock.released(&cup(0.481, 0.2, 0.108));
    stock.follow(&cup(0.481, 0.2, 0.108));
    assert!(place(&stock, "plate").1.z.abs() < 1e-6 && (place(&stock, "block").1.z - 0.008).abs() < 1e-6);
}

#[test]
fn the_bin_takes_what_falls_with_its_middle_inside_and_keeps_it_out_of_sight() {
    let stock = stock(&format!("{BLOCK}, {PLATE}"));
    carry(&stock, &cup(0.4, 0.0, 0.02), &cup(0.18 + 0.08, 0.36, 0.2));
    let (first, at) = place(&stock, "block");
    assert_eq!(first, Place::InBin);
    assert!((at.z - Bin::FLOOR).abs() < 1e-6, "{at}");
    carry(&stock, &cup(0.5, 0.1, 0.008), &cup(0.18 + 0.06, 0.36, 0.2));
    let (second, at) = place(&stock, "plate");
    assert_eq!(second, Place::InBin);
    assert!((at.z - Bin::FLOOR - 0.02).abs() < 1e-6, "on the block: {at}");
    assert!(stock.inventory().places().is_empty());
}

#[test]
fn what_falls_beside_bin_and_table_is_there() {
    let stock = stock(&format!("{BLOCK}, {PLATE}"));
    carry(&stock, &cup(0.4, 0.0, 0.02), &cup(0.18 + 0.0925, 0.36, 0.2));
    assert_eq!(place(&stock, "block").0, Place::OnTable, "its middle is over the wall");
    carry(&stock, &cup(0.5, 0.1, 0.008), &cup(0.0, -0.8, 0.2));
    assert_eq!(place(&stock, "plate").0, Place::OffTable);
    assert_eq!(stock.inventory().places().len(), 1);
}

#[test]
fn a_reset_empties_cup_and_bin() {
    let world = World::from_yaml(&format!("objects: [{BLOCK}, {PLATE}]"), Path::new("")).expect("a world");
    let stock = Stock::new(&world).expect("meshes");
    assert!(!stock.reset(&world).expect("meshes"), "nothing was changed");
    carry(&stock, &cup(0.4, 0.0, 0.02), &cup(0.18, 0.36, 0.2));
    stock.sealed(&cup(0.5, 0.1, 0.008));
    assert!(stock.reset(&world).expect("meshes"));
    for object in stock.objects(Some(&cup(0.3, 0.3, 0.3))) {
        assert_eq!(object.place, Place::OnTable);
        assert_eq!(object.base_from_object, object.base_from_object_at_start);
    }
}

#[test]
fn a_rim_knows_how_deep_it_is_pressed() {
    let stock = stock(BLOCK);
    let pressed = |x: f64, z: f64| stock.pressed(&cup(x, 0.0, z)).expect("the table at least");
    assert_eq!(pressed(0.4, 0.1), ("table".to_owned(), 0.0));
    let (name, depth) = pressed(0.4, 0.014);
    assert!(name == "block" && (depth - 0.006).abs() < 1e-6, "{depth}");
    let (name, depth) = pressed(0.425, 0.014);
    assert!(
        name == "block" && (depth - 0.006).abs() < 1e-6,
        "one side of it: {depth}"
    );
    let (name, depth) = pressed(0.6, -0.004);
    assert!(name == "table" && (depth - 0.004).abs() < 1e-6, "{depth}");
}
