//! Single configurations of the xArm7: free ones, and what they touch when they are not.

mod common;

use std::sync::Arc;

use collision::{Bin, CarriedObject, Checker, CollisionError, PointCloud, Scene, Shape, Touched};
use common::{HOME, arm, at, cell, chain};
use geometry::{RigidTransform, TriangleMesh};
use kinematics::IkOptions;
use nalgebra::{Point3, SVector, UnitQuaternion, Vector3};

/// Joint angles with the cup's mouth at a point in the base frame, looking down.
fn looking_down(x: f64, y: f64, z: f64) -> [f64; 7] {
    let rotation = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
    let pose = RigidTransform::from_parts(Vector3::new(x, y, z), rotation);
    let found = chain().solve(&pose, &SVector::from(HOME), &IkOptions::default());
    found.expect("within reach").angles.into()
}

/// Names of what touches.
fn touching(scene: &Scene, angles: &[f64; 7]) -> Option<String> {
    let arm = arm();
    let found = Checker::new(&arm, scene).check(angles).expect("finite angles");
    found.map(|contact| format!("{} and {}", contact.link, contact.with.name()))
}

#[test]
fn usual_poses_are_free_in_the_cell() {
    let poses = [
        HOME,
        [0.0; 7],
        [0.5, -0.6, 0.3, 1.2, -0.4, 1.6, 0.9],
        [0.0, -1.0, 0.0, 0.5, 0.0, 1.5, 0.0],
        looking_down(0.43, 0.0, 0.05),
        looking_down(0.35, 0.15, 0.02),
    ];
    let nothing = Scene::new();
    for angles in poses {
        let found = touching(&nothing, &angles);
        assert_eq!(
            found,
            None,
            "{angles:?} {:?}",
            Checker::new(&arm(), &nothing).check(&angles)
        );
    }
    // At all zeros the cup is at the table's height by construction: the flange is 120.5 mm up and the cup 126 mm long.
    for angles in [poses[0], poses[4], poses[5]] {
        assert_eq!(touching(&cell(), &angles), None, "{angles:?}");
    }
    assert_eq!(touching(&cell(), &[0.0; 7]), Some("vacuum_cup and table".to_owned()));
}

#[test]
fn forearm_against_the_base_is_found() {
    // Upper arm level, elbow bent so far that the forearm comes back under it, to the base.
    let (arm, scene) = (arm(), Scene::new());
    let checker = Checker::new(&arm, &scene);
    let bent = |elbow: f64| [0.0, 1.7, 0.0, elbow, 0.0, 0.22, 0.0];
    let found = checker.check(&bent(0.71)).unwrap().expect("the forearm is in the base");
    assert_eq!((found.link, found.with), ("link_base", Touched::Link("link5")));
    assert!(found.depth() > 0.005, "{found}");
    assert_eq!(checker.check(&bent(1.0)).unwrap(), None);
    // The depth grows with the angle that is missing: the wrist is 0.34 m from the elbow.
    let deeper = checker.check(&bent(0.69)).unwrap().expect("deeper").depth() - found.depth();
    assert!((0.002..=0.0075).contains(&deeper), "{deeper}");
}

#[test]
fn depth_in_the_table_is_how_far_the_cup_is_below_it() {
    let mut scene = Scene::new();
    scene.add_half_space("floor", &Vector3::z_axis(), 0.0).unwrap();
    scene.except("link_base", "floor").unwrap();
    let arm = arm();
    for height in [-0.01, 0.012] {
        let angles = looking_down(0.4, 0.1, height);
        let found = Checker::new(&arm, &scene)
            .clearance(&angles, 0.05)
            .unwrap()
            .expect("near");
        assert_eq!((found.link, found.with.name()), ("vacuum_cup", "floor"));
        assert!((found.distance - height).abs() < 1e-6, "{found}");
    }
    assert_eq!(
        touching(&cell(), &looking_down(0.4, 0.1, -0.01)),
        Some("vacuum_cup and table".to_owned())
    );
}

#[test]
fn panel_is_named() {
    // Straight out to the side, low: into the panel that stands there.
    let panel = looking_down(0.43, 0.49, 0.10);
    let found = touching(&cell(), &panel).expect("a panel is there");
    assert!(found.ends_with(" and panel_l2"), "{found}");
}

fn with_bin() -> Scene {
    let bin = Bin {
        inside: [0.3, 0.4, 0.12],
        wall: 0.005,
    };
    let mut scene = Scene::new();
    scene.add_bin("bin", &at(0.35, -0.3, 0.005), &bin).unwrap();
    scene
}

#[test]
fn bin_is_open_above_and_has_walls_and_a_floor() {
    let scene = with_bin();
    assert_eq!(touching(&scene, &looking_down(0.35, -0.3, 0.06)), None);
    assert_eq!(
        touching(&scene, &looking_down(0.35, -0.3, 0.004)),
        Some("vacuum_cup and bin".to_owned())
    );
    // The camera hangs higher than the walls here, so only the gripper is beside them.
    for (x, y) in [(0.5, -0.3), (0.2, -0.3), (0.35, -0.1), (0.35, -0.5)] {
        let found = touching(&scene, &looking_down(x, y, 0.11));
        assert_eq!(found, Some("vacuum_cup and bin".to_owned()), "{x} {y}");
    }
}

#[test]
fn carried_object_hits_the_bin_but_not_the_cup() {
    let (arm, scene) = (arm(), with_bin());
    let above = looking_down(0.35, -0.3, 0.2);
    let low = looking_down(0.35, -0.3, 0.09);
    let bodies = [
        Shape::cuboid(&at(0.0, 0.0, 0.05), [0.04, 0.04, 0.1]).unwrap(),
        Shape::capsule(&Point3::new(0.0, 0.0, 0.02), &Point3::new(0.0, 0.0, 0.08), 0.02).unwrap(),
        Shape::convex_hull(&corners([0.02, 0.02, 0.05]).map(|p| p + Vector3::new(0.0, 0.0, 0.05))).unwrap(),
    ];
    for body in bodies {
        let object = CarriedObject::new(
            &arm,
            "bolt",
            std::slice::from_ref(&body),
            &["vacuum_gripper", "vacuum_cup"],
        )
        .unwrap();
        let checker = Checker::new(&arm, &scene).carrying(&object);
        assert_eq!(checker.check(&above).unwrap(), None, "{body:?}");
        let found = checker.check(&low).unwrap().expect("it is 100 mm long");
        assert_eq!((found.link, found.with.name()), ("bolt", "bin"));
        assert!((found.depth() - 0.015).abs() < 1e-3, "{found}, {body:?}");
        assert_eq!(Checker::new(&arm, &scene).check(&low).unwrap(), None);
    }
}

fn corners(half: [f64; 3]) -> [Point3<f64>; 8] {
    std::array::from_fn(|corner| {
        let side = |axis: usize| {
            if corner >> axis & 1 == 1 {
                half[axis]
            } else {
                -half[axis]
            }
        };
        Point3::new(side(0), side(1), side(2))
    })
}

#[test]
fn long_carried_object_hits_the_arm() {
    let (arm, scene) = (arm(), Scene::new());
    let plank = Shape::cuboid(&at(0.0, 0.0, 0.01), [0.9, 0.1, 0.02]).unwrap();
    let object = CarriedObject::new(&arm, "plank", &[plank], &["vacuum_gripper", "vacuum_cup"]).unwrap();
    let found = Checker::new(&arm, &scene).carrying(&object).check(&[0.0; 7]).unwrap();
    let found = found.expect("it reaches through the base");
    assert_eq!((found.link, found.with), ("plank", Touched::Link("link_base")));
}

#[test]
fn points_are_touched_and_exceptions_hold() {
    let arm = arm();
    let angles = looking_down(0.43, 0.0, 0.05);
    let point = Point3::new(0.43, 0.0, 0.045);
    let mut scene = Scene::new();
    scene
        .add_cloud("object", Arc::new(PointCloud::new(&[point], 0.002).unwrap()))
        .unwrap();
    let checker = Checker::new(&arm, &scene);
    assert_eq!(checker.check(&angles).unwrap(), None);
    let near = checker.clearance(&angles, 0.02).unwrap().expect("5 mm below the cup");
    assert!((near.distance - 0.003).abs() < 1e-6, "{near}");
    let close = Checker::new(&arm, &scene).with_margin(0.004).unwrap();
    assert_eq!(
        close.check(&angles).unwrap().map(|contact| contact.with),
        Some(Touched::Obstacle("object"))
    );

    scene.except("vacuum_cup", "object").unwrap();
    assert_eq!(
        Checker::new(&arm, &scene)
            .with_margin(0.004)
            .unwrap()
            .check(&angles)
            .unwrap(),
        None
    );
}

/// The same body, given in several ways, is as near.
#[test]
fn obstacles_of_all_kinds_are_as_far_as_they_are() {
    let arm = arm();
    let angles = looking_down(0.43, 0.0, 0.1);
    let top = 0.1 - 0.007;
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let mesh = TriangleMesh {
        vertices: corners([0.02, 0.02, 0.02]).to_vec(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    };
    let middle = at(0.43, 0.0, top - 0.02);
    let hull = corners([0.02, 0.02, 0.02]).map(|corner| middle.transform_point(&corner));
    let mut scene = Scene::new();
    scene.add_box("box", &middle, [0.04; 3]).unwrap();
    scene.add_mesh("mesh", &middle, &mesh).unwrap();
    scene.add_convex_hull("hull", &hull).unwrap();
    scene
        .add("cylinder", vec![Shape::cylinder(&middle, 0.02, 0.04).unwrap()])
        .unwrap();
    scene
        .add(
            "ball",
            vec![Shape::sphere(&Point3::new(0.43, 0.0, top - 0.02), 0.02).unwrap()],
        )
        .unwrap();
    scene.add_half_space("floor", &Vector3::z_axis(), top).unwrap();
    let names: Vec<String> = scene.names().map(str::to_owned).collect();
    for name in &names {
        let mut alone = scene.clone();
        for other in names.iter().filter(|other| *other != name) {
            alone.remove(other).unwrap();
        }
        for link in ["link_base", "link1"] {
            alone.except(link, name).unwrap();
        }
        let found = Checker::new(&arm, &alone)
            .clearance(&angles, 0.05)
            .unwrap()
            .expect("7 mm away");
        assert_eq!((found.link, found.with.name()), ("vacuum_cup", name.as_str()));
        assert!((found.distance - 0.007).abs() < 1e-5, "{found}");
    }
}

#[test]
fn body_within_a_closed_mesh_is_in_contact() {
    let arm = arm();
    let vertices = corners([0.5, 0.5, 0.5])
        .map(|point| point + Vector3::new(0.4, 0.0, 0.5))
        .to_vec();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mut mesh = TriangleMesh { vertices, triangles };
    let mut scene = Scene::new();
    scene.add_mesh("solid", &at(0.0, 0.0, 0.0), &mesh).unwrap();
    let found = Checker::new(&arm, &scene).check(&HOME).unwrap();
    assert!(found.is_some_and(|contact| contact.depth() > 0.1), "{found:?}");
    // Without its lid it is a box to reach into: corner 5, 7, 6, 4 are above.
    mesh.triangles.drain(2..4);
    let mut open = Scene::new();
    open.add_mesh("open", &at(0.0, 0.0, -0.5), &mesh).unwrap();
    open.except("link_base", "open").unwrap();
    let found = Checker::new(&arm, &open).check(&looking_down(0.6, 0.0, 0.3)).unwrap();
    assert_eq!(found.map(|contact| contact.link), None);
}

#[test]
fn numbers_that_are_none_are_refused() {
    let (arm, scene) = (arm(), cell());
    let checker = Checker::new(&arm, &scene);
    let mut angles = HOME;
    angles[3] = f64::NAN;
    let error = checker.check(&angles).unwrap_err();
    assert!(error.to_string().contains("joint4"), "{error}");
    assert!(checker.clearance(&HOME, f64::NAN).is_err());
    assert!(checker.with_margin(-0.1).is_err());
    let error = PointCloud::new(&[Point3::origin(), Point3::new(0.0, f64::NAN, 0.0)], 0.001).unwrap_err();
    assert!(error.to_string().contains("point 1"), "{error}");
    let mut scene = scene.clone();
    let error = scene.add_box("table", &at(0.0, 0.0, 0.0), [1.0; 3]).unwrap_err();
    assert_eq!(
        error,
        CollisionError::NameTaken {
            name: "table".to_owned()
        }
    );
    assert!(scene.except("link1", "wall").is_err());
    assert!(
        Shape::convex_hull(&[
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(1.0, 1.0, 0.0)
        ])
        .is_err()
    );
}
