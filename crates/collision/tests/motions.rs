//! Contacts between samples.

mod common;

use std::sync::Arc;

use collision::{
    CarriedObject, Checker, CollisionError, FunctionPath, JointPath, PointCloud, Scene, SelfCollision, Shape,
};
use common::{HOME, arm, at, cell, chain, robot};
use nalgebra::{Point3, SVector};
use proptest::prelude::*;
use trajectory::{JointLimits, Motion};

const TOLERANCE: f64 = 5e-4;

/// Joint 1 turns at a constant speed.
fn turn(speed: f64, duration: f64) -> FunctionPath<impl Fn(f64) -> [f64; 7] + Copy, 7> {
    let angles = move |time: f64| {
        let mut angles = HOME;
        angles[0] = -0.5 + speed * time;
        angles
    };
    let mut speeds = [0.0; 7];
    speeds[0] = speed;
    FunctionPath {
        duration,
        speeds,
        angles,
    }
}

/// A plate of 2 mm that stands in the way of the tool, across it.
fn plate() -> Scene {
    let tool = chain().forward(&SVector::from(HOME)).unwrap().translation();
    let mut scene = Scene::new();
    scene
        .add_box("plate", &at(tool.x, 0.0, tool.z), [0.3, 0.002, 0.3])
        .unwrap();
    scene
}

#[test]
fn thin_plate_is_found_where_samples_miss_it() {
    let (arm, scene) = (arm(), plate());
    let checker = Checker::new(&arm, &scene);
    // 94 mm of gripper and 2 mm of plate pass in less than 50 ms: the tool's speed is 0.35 m × 20 rad/s = 7 m/s.
    let path = turn(20.0, 0.05);
    for sample in [0.0, 0.05] {
        assert_eq!(checker.check(&(path.angles)(sample)).unwrap(), None);
    }
    let found = checker
        .check_motion(&path, TOLERANCE)
        .unwrap()
        .expect("the plate is in the way");
    assert_eq!(found.contact.with.name(), "plate");
    assert!(found.contact.depth() <= TOLERANCE, "{found}");
    let just_before = checker.clearance(&(path.angles)(found.time - 2e-4), 0.1).unwrap();
    assert!(
        just_before.is_some_and(|contact| contact.distance > 0.0),
        "{just_before:?}"
    );
}

#[test]
fn plate_of_points_is_found_too_with_an_object_in_the_tool() {
    let arm = arm();
    let tool = chain().forward(&SVector::from(HOME)).unwrap().translation();
    let step = |index: i32| 0.005 * f64::from(index);
    let points: Vec<_> = (-30..=30)
        .flat_map(|x| (-20..=10).map(move |z| (x, z)))
        .map(|(x, z)| Point3::new(tool.x + step(x), 0.0, tool.z + step(z)))
        .collect();
    let mut scene = Scene::new();
    scene
        .add_cloud("wall", Arc::new(PointCloud::new(&points, 0.001).unwrap()))
        .unwrap();
    let path = turn(20.0, 0.05);
    let checker = Checker::new(&arm, &scene);
    let bare = checker
        .check_motion(&path, TOLERANCE)
        .unwrap()
        .expect("a wall is in the way");
    assert_eq!(
        (bare.contact.link, bare.contact.with.name()),
        ("vacuum_gripper", "wall")
    );

    // An object that reaches farther to the side meets the wall before the gripper does.
    let bar = Shape::cuboid(&at(0.0, 0.0, 0.02), [0.03, 0.16, 0.03]).unwrap();
    let object = CarriedObject::new(&arm, "bar", &[bar], &["vacuum_gripper", "vacuum_cup"]).unwrap();
    let loaded = checker
        .carrying(&object)
        .check_motion(&path, TOLERANCE)
        .unwrap()
        .expect("sooner");
    assert_eq!(loaded.contact.link, "bar");
    assert!(loaded.time < bare.time, "{loaded}, {bare}");
}

#[test]
fn contact_at_the_begin_has_its_full_depth_and_one_at_the_end_is_found() {
    let (arm, scene) = (arm(), plate());
    let checker = Checker::new(&arm, &scene);
    let mut path = turn(1.0, 1.0);
    let touch = checker
        .check_motion(&path, TOLERANCE)
        .unwrap()
        .expect("on the way")
        .time;
    path.duration = touch - 1e-3;
    assert_eq!(checker.check_motion(&path, TOLERANCE).unwrap(), None);
    path.duration = touch + 1e-3;
    assert!(checker.check_motion(&path, TOLERANCE).unwrap().is_some());
    let within = FunctionPath {
        duration: 1.0,
        speeds: [1.0; 7],
        angles: |_| HOME,
    };
    let found = checker
        .check_motion(&within, TOLERANCE)
        .unwrap()
        .expect("from the begin");
    assert!(found.time == 0.0 && found.contact.depth() > 0.01, "{found}");
}

#[test]
fn path_that_is_faster_than_it_says_is_refused() {
    let (arm, scene) = (arm(), plate());
    let mut path = turn(1.0, 1.0);
    path.speeds[0] = 0.5;
    let error = Checker::new(&arm, &scene).check_motion(&path, TOLERANCE).unwrap_err();
    assert!(
        matches!(error, CollisionError::FasterThanStated { joint: 1, .. }),
        "{error}"
    );
    path.speeds[0] = f64::NAN;
    assert!(Checker::new(&arm, &scene).check_motion(&path, TOLERANCE).is_err());
    path.speeds[0] = 1.0;
    assert!(Checker::new(&arm, &scene).check_motion(&path, 0.0).is_err());
    path.duration = f64::INFINITY;
    assert!(Checker::new(&arm, &scene).check_motion(&path, TOLERANCE).is_err());
    let lost = FunctionPath {
        duration: 1.0,
        speeds: [1.0; 7],
        angles: |time| [if time > 0.0 { f64::NAN } else { 0.3 }; 7],
    };
    assert!(Checker::new(&arm, &scene).check_motion(&lost, TOLERANCE).is_err());
}

struct MinimumJerk(Motion<7>);

impl JointPath<7> for MinimumJerk {
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    fn angles(&self, time: f64) -> [f64; 7] {
        self.0.sample(time).map(|state| state.position)
    }

    fn speed_bounds(&self, _from: f64, _to: f64) -> [f64; 7] {
        self.0.joints().each_ref().map(|joint| joint.extremes().velocity)
    }
}

fn angles() -> impl Strategy<Value = [f64; 7]> {
    (
        -3.0..3.0,
        -2.0..2.0,
        -3.0..3.0,
        -0.1..3.9,
        -3.0..3.0,
        -1.6..3.1,
        -3.0..3.0,
    )
        .prop_map(Into::into)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Dense samples of random motions: none is deeper than the tolerance before the contact that was found, and the
    /// contact found is one.
    #[test]
    fn dense_samples_agree(from in angles(), to in angles(), margin in 0.0..0.02_f64) {
        let limits = JointLimits { lower: -7.0, upper: 7.0, velocity: 3.0, acceleration: 20.0, jerk: 400.0 };
        let path = MinimumJerk(Motion::rest_to_rest(&from, &to, &[limits; 7]).unwrap());
        let (arm, scene) = (arm_once(), cell());
        let checker = Checker::new(arm, &scene).with_margin(margin).unwrap();
        let found = checker.check_motion(&path, TOLERANCE).unwrap();
        let end = found.map_or(path.duration(), |found| found.time);
        let samples = if end > 0.0 { 400 } else { 0 };
        for sample in 0..samples {
            let time = end * f64::from(sample) / f64::from(samples);
            if let Some(contact) = checker.check(&path.angles(time)).unwrap() {
                prop_assert!(contact.distance >= margin - TOLERANCE, "{contact} at {time}, found {found:?}");
            }
        }
        if let Some(found) = found {
            let there = checker.check(&path.angles(found.time)).unwrap();
            prop_assert!(there.is_some_and(|contact| contact.distance < margin));
            prop_assert!(found.time == 0.0 || found.contact.distance >= margin - TOLERANCE - 1e-9, "{found}");
        }
    }
}

fn arm_once() -> &'static collision::ArmModel<7> {
    static ARM: std::sync::OnceLock<collision::ArmModel<7>> = std::sync::OnceLock::new();
    ARM.get_or_init(|| {
        let leave_out = SelfCollision {
            never: &collision::XARM7_NEVER_TOUCHING,
            free_at: &[HOME, [0.0; 7]],
        };
        collision::ArmModel::from_urdf(&robot(), "link_base", chain(), &leave_out).unwrap()
    })
}
