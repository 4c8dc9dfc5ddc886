use super::*;
use crate::model::tests::{HOME, model};
use kinematics::IkOptions;

const CONTACT: Handling = Handling {
    contact: true,
    carried: None,
};

fn carrying(radius: f64, length: f64) -> Handling {
    Handling {
        contact: true,
        carried: Some(Carried { radius, length }),
    }
}

/// The tool with its lip there (metres), pointing down, tilted to the side (radians).
fn pose(place: [f64; 3], tilt: f64) -> RigidTransform {
    let rotation = UnitQuaternion::from_euler_angles(std::f64::consts::PI + tilt, 0.0, 0.0);
    RigidTransform::from_parts(Vector3::from(place), rotation)
}

fn line(model: &Model, from: [f64; 3], to: [f64; 3], tilt: f64) -> Trajectory<7> {
    let start = model
        .chain
        .solve(&pose(from, tilt), &SVector::from(HOME), &IkOptions::default())
        .expect("within reach");
    let planner = model.planner(0.1).expect("a speed");
    let plan = planner.line(&start.angles.into(), &pose(to, tilt));
    plan.expect("a line").trajectory
}

/// What touches what, as "link with obstacle"; nothing: the way is free.
fn refused(model: &Model, trajectory: &Trajectory<7>, handling: &Handling) -> Option<String> {
    match model.require_free(trajectory, handling) {
        Ok(()) => None,
        Err(MotionError::Collision { link, with, .. }) => Some(format!("{link} with {with}")),
        Err(error) => panic!("{error}"),
    }
}

fn above(z: f64) -> [f64; 3] {
    [0.43, 0.0, z]
}

#[test]
fn cup_comes_down_to_thin_objects_and_leaves_them() {
    let model = model();
    for z in [0.003, 0.0, -0.004] {
        let down = line(&model, above(0.053), above(z), 0.0);
        assert_eq!(refused(&model, &down, &CONTACT), None, "{z}");
        assert!(refused(&model, &down, &Handling::default()).is_some(), "{z}");
        let up = line(&model, above(z), above(0.103), 0.0);
        assert_eq!(refused(&model, &up, &CONTACT), None, "{z}");
        assert!(refused(&model, &up, &Handling::default()).is_some(), "{z}");
    }
    for tilt in [-0.52, 0.52] {
        let down = line(&model, above(0.08), above(0.03), tilt);
        assert_eq!(refused(&model, &down, &CONTACT), None, "{tilt}");
    }
}

#[test]
fn cup_presses_no_deeper_than_it_may_and_touches_nothing_on_the_way() {
    let model = model();
    let deep = line(&model, above(0.05), above(-0.0062), 0.0);
    let error = model.require_free(&deep, &CONTACT).expect_err("too deep").to_string();
    assert!(
        error.contains("vacuum_cup with") && error.contains("less than -5.0 mm"),
        "{error}"
    );
    // Sideways over the mat it would be torn.
    let along = line(&model, [0.38, 0.0, 0.002], [0.48, 0.0, 0.002], 0.0);
    assert!(refused(&model, &along, &CONTACT).is_some());
}

#[test]
fn carried_object_leaves_what_it_stands_on() {
    let model = model();
    let up = line(&model, above(0.03), above(0.13), 0.0);
    // It may be drawn somewhat too long.
    for length in [0.02, 0.03, 0.037] {
        assert_eq!(refused(&model, &up, &carrying(0.05, length)), None, "{length}");
    }
    let no_contact = Handling {
        contact: false,
        ..carrying(0.05, 0.03)
    };
    assert!(refused(&model, &up, &no_contact).is_some_and(|found| found.starts_with("carried object with")));
    // With the tool tilted one side of the cylinder is in the table.
    let tilted = line(&model, above(0.03), above(0.13), 0.4);
    assert_eq!(refused(&model, &tilted, &carrying(0.05, 0.03)), None);
    assert!(
        refused(&model, &up, &carrying(0.05, 0.065)).is_some(),
        "35 mm in the table"
    );
}

#[test]
fn carried_object_is_neither_pushed_down_nor_drawn_along() {
    let model = model();
    let carried = carrying(0.05, 0.03);
    for to in [above(0.027), [0.53, 0.0, 0.03]] {
        let way = line(&model, above(0.03), to, 0.0);
        let found = refused(&model, &way, &carried).expect("nearer than at the begin, or too far along");
        assert!(found.starts_with("carried object with"), "{found}");
    }
}

#[test]
fn carried_object_collides_with_the_wall_of_the_bin() {
    let model = model();
    let into = line(&model, [0.33, 0.28, 0.09], [0.18, 0.36, 0.09], 0.0);
    let found = refused(&model, &into, &carrying(0.04, 0.05));
    assert_eq!(found.as_deref(), Some("carried object with bin"));
    assert_eq!(refused(&model, &into, &CONTACT), None);
}
