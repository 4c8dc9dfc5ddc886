//! What may touch, and how deep, and that nothing else may.

mod common;

use collision::{Allowance, Checker, CollisionError, FunctionPath, JointPath, Stretch};
use common::{HOME, arm, cell, chain};
use geometry::RigidTransform;
use kinematics::IkOptions;
use nalgebra::{SVector, UnitQuaternion, Vector3};

const MARGIN: f64 = 0.005;
const PRESS: f64 = 0.005;

fn may_press() -> Vec<Allowance> {
    vec![Allowance {
        link: "vacuum_cup".to_owned(),
        obstacle: None,
        margin: -PRESS,
    }]
}

/// With the cup's mouth over W, so high (metres), tilted about an axis that lies so (radians).
fn tilted(z: f64, tilt: f64, about: f64) -> [f64; 7] {
    let down = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
    let axis = Vector3::new(about.cos(), about.sin(), 0.0);
    let rotation = UnitQuaternion::from_scaled_axis(axis * tilt) * down;
    let pose = RigidTransform::from_parts(Vector3::new(0.43, 0.0, z), rotation);
    let found = chain().solve(&pose, &SVector::from(HOME), &IkOptions::default());
    found.expect("within reach").angles.into()
}

fn contact(angles: &[f64; 7], allowances: &[Allowance]) -> Option<(String, String, f64)> {
    let (arm, scene) = (arm(), cell());
    let checker = Checker::new(&arm, &scene).with_margin(MARGIN).unwrap();
    let found = checker.allowing(allowances).unwrap().check(angles).unwrap();
    found.map(|contact| {
        (
            contact.link.to_owned(),
            contact.with.name().to_owned(),
            contact.distance,
        )
    })
}

#[test]
fn cup_may_touch_thin_objects_and_press_and_all_else_keeps_its_margin() {
    for z in [0.03, 0.006, 0.003, 0.0, -0.0049] {
        assert_eq!(contact(&tilted(z, 0.0, 0.0), &may_press()), None, "{z}");
        let plain = contact(&tilted(z, 0.0, 0.0), &[]).map(|(link, ..)| link);
        let expected = (z < MARGIN).then(|| "vacuum_cup".to_owned());
        assert_eq!(plain, expected, "{z}");
    }
    let (link, _, distance) = contact(&tilted(-0.0051, 0.0, 0.0), &may_press()).expect("too deep");
    assert_eq!(link, "vacuum_cup");
    assert!((distance + 0.0051).abs() < 1e-6, "{distance}");
    // Where the body is nearer than the margin nothing helps; here the cup is 7.1 mm deep as well.
    let deep = [Allowance {
        margin: -0.02,
        ..may_press()[0].clone()
    }];
    let (link, _, distance) = contact(&tilted(-0.0071, 0.0, 0.0), &deep).expect("the body is 4.9 mm above");
    assert_eq!(link, "vacuum_gripper");
    assert!((distance - 0.0049).abs() < 1e-6, "{distance}");
}

#[test]
fn tilted_cup_may_touch_to_all_sides() {
    for side in 0..12 {
        let angles = tilted(0.03, 30_f64.to_radians(), f64::from(side) * 30_f64.to_radians());
        assert_eq!(contact(&angles, &may_press()), None, "side {side}");
    }
}

#[test]
fn allowance_counts_for_its_obstacle_only_and_the_least_one_counts() {
    let angles = tilted(0.003, 0.0, 0.0);
    let for_one = |obstacle: &str, margin: f64| Allowance {
        link: "vacuum_cup".to_owned(),
        obstacle: Some(obstacle.to_owned()),
        margin,
    };
    let with = |allowances: &[Allowance]| contact(&angles, allowances).map(|(_, with, _)| with);
    assert_eq!(with(&[for_one("table", 0.0)]).as_deref(), Some("mat"));
    assert_eq!(with(&[for_one("table", 0.0), for_one("mat", 0.002)]), None);
    assert_eq!(
        with(&[for_one("table", 0.0), for_one("mat", 0.004)]).as_deref(),
        Some("mat")
    );
    assert_eq!(
        with(&[for_one("table", 0.0), for_one("mat", 0.004), for_one("mat", 0.0)]),
        None
    );
}

/// Straight down at 0.1 m/s in joint space between two solutions.
fn down(from: f64, to: f64) -> FunctionPath<impl Fn(f64) -> [f64; 7], 7> {
    let (above, below) = (tilted(from, 0.0, 0.0), tilted(to, 0.0, 0.0));
    let speeds = std::array::from_fn(|joint: usize| (below[joint] - above[joint]).abs());
    FunctionPath {
        duration: 1.0,
        speeds,
        angles: move |time| std::array::from_fn(|joint| above[joint] + time * (below[joint] - above[joint])),
    }
}

#[test]
fn motion_may_press_as_deep_as_it_is_allowed() {
    let (arm, scene) = (arm(), cell());
    let checker = Checker::new(&arm, &scene).with_margin(MARGIN).unwrap();
    let allowances = may_press();
    let pressing = checker.allowing(&allowances).unwrap();
    let path = down(0.05, -0.004);
    let found = checker
        .check_motion(&path, 1e-3)
        .unwrap()
        .expect("nearer than the margin");
    assert_eq!(found.contact.link, "vacuum_cup");
    assert!((found.contact.distance - MARGIN).abs() < 1.1e-3, "{found}");
    assert_eq!(pressing.check_motion(&path, 1e-3).unwrap(), None);
    let deeper = pressing.check_motion(&down(0.05, -0.0065), 1e-3).unwrap();
    let deeper = deeper.expect("deeper than allowed");
    assert!((-PRESS - 1.1e-3..-PRESS).contains(&deeper.contact.distance), "{deeper}");
    // Only its second half may.
    let (first, second) = (
        Stretch::of(&path, 0.0, 0.8).unwrap(),
        Stretch::of(&path, 0.8, 1.0).unwrap(),
    );
    assert_eq!(checker.check_motion(&first, 1e-3).unwrap(), None);
    assert!(checker.check_motion(&second, 1e-3).unwrap().is_some());
    assert_eq!(pressing.check_motion(&second, 1e-3).unwrap(), None);
    assert!((second.duration() - 0.2).abs() < 1e-12);
    for (at_end, expected) in second.angles(0.2).iter().zip(path.angles(1.0)) {
        assert!((at_end - expected).abs() < 1e-12, "{at_end} {expected}");
    }
}

#[test]
fn what_cannot_be_allowed_is_refused() {
    let (arm, scene) = (arm(), cell());
    let checker = Checker::new(&arm, &scene);
    let refused = |change: &dyn Fn(&mut Allowance)| {
        let mut allowances = may_press();
        change(&mut allowances[0]);
        checker.allowing(&allowances).unwrap_err()
    };
    for margin in [f64::NAN, -0.2, 1.5] {
        let error = refused(&|allowance| allowance.margin = margin);
        assert!(matches!(error, CollisionError::Number { .. }), "{error}");
    }
    let error = refused(&|allowance| allowance.link = "cup".to_owned());
    assert_eq!(error.to_string(), "there is no link or carried object `cup`");
    let error = refused(&|allowance| allowance.obstacle = Some("wall".to_owned()));
    assert_eq!(error.to_string(), "there is no obstacle `wall`");
    assert!(Stretch::of(&down(0.05, 0.02), 0.5, 1.5).is_err());
    assert!(Stretch::of(&down(0.05, 0.02), 0.5, f64::NAN).is_err());
}
