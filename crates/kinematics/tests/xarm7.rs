//! The xArm7: poses computed by others, derivatives by differences, and angles that lead back to their poses.

use std::path::Path;

use geometry::RigidTransform;
use kinematics::{Chain, IkOptions, KinematicsError, ModifiedDh};
use nalgebra::{SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

type Angles = SVector<f64, 7>;

const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

fn robot() -> urdf_rs::Robot {
    urdf_rs::read_file(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../urdf/xarm7.urdf"))
        .expect("xarm7.urdf is a URDF")
}

fn arm() -> Chain<7> {
    Chain::from_urdf(&robot(), "link_base", "link_eef").expect("a chain of seven joints")
}

/// Nominal dimensions as the controller keeps them.
fn nominal() -> [ModifiedDh; 7] {
    let quarter = std::f64::consts::FRAC_PI_2;
    let row = |alpha: f64, a: f64, d: f64| ModifiedDh {
        theta: 0.0,
        d,
        alpha: alpha * quarter,
        a,
    };
    [
        row(0.0, 0.0, 0.267),
        row(-1.0, 0.0, 0.0),
        row(1.0, 0.0, 0.293),
        row(1.0, 0.0525, 0.0),
        row(1.0, 0.0775, 0.3425),
        row(1.0, 0.0, 0.0),
        row(-1.0, 0.076, 0.097),
    ]
}

/// Angles, millimetres and quaternion xyzw (pinocchio 4.1).
const POSES: [([f64; 7], [f64; 3], [f64; 4]); 6] = [
    ([0.0; 7], [206.0, 0.0, 120.5], [1.0, 0.0, 0.0, 0.0]),
    (HOME, [350.6483, 0.0, 374.0272], [1.0, 0.0, 0.0, 0.0]),
    (
        [0.5, -0.6, 0.3, 1.2, -0.4, 1.6, 0.9],
        [201.0903, 214.2523, 614.8912],
        [0.952_308, -0.087_723, 0.264_960, 0.123_327],
    ),
    (
        [-1.2, 0.3, 0.8, 2.1, 1.5, -0.9, -2.2],
        [286.3504, -368.5048, 694.6555],
        [0.581_813, -0.352_031, 0.491_069, 0.544_443],
    ),
    (
        [2.4, -1.1, -2.0, 0.5, 3.0, 2.2, 0.1],
        [351.6221, 173.3205, 173.2296],
        [0.373_767, 0.433_407, 0.353_353, 0.739_999],
    ),
    (
        [0.0, -1.0, 0.0, 0.5, 0.0, 1.5, 0.0],
        [204.9390, 0.0, 425.5642],
        [1.0, 0.0, 0.0, 0.0],
    ),
];

fn rotation(xyzw: [f64; 4]) -> UnitQuaternion<f64> {
    RigidTransform::from_quaternion_xyzw([0.0; 3], xyzw).unwrap().rotation()
}

#[test]
fn poses_are_those_of_other_programs() {
    let by_dh = arm().with_modified_dh(&nominal()).unwrap();
    for (angles, millimetres, xyzw) in POSES {
        for chain in [arm(), by_dh.clone()] {
            let pose = chain.forward(&Angles::from(angles)).unwrap();
            let off = pose.translation() * 1e3 - Vector3::from(millimetres);
            assert!(off.norm() < 2e-4, "{angles:?}: {off}");
            let turned = pose.rotation().angle_to(&rotation(xyzw));
            assert!(turned < 5e-6, "{angles:?}: {turned}");
        }
    }
}

#[test]
fn the_tool_is_at_the_cups_mouth() {
    let tool: Chain<7> = Chain::from_urdf(&robot(), "link_base", "link_tcp").unwrap();
    let by_hand = arm().with_tool(&RigidTransform::from_parts(
        Vector3::new(0.0, 0.0, 0.126),
        UnitQuaternion::identity(),
    ));
    let home = Angles::from(HOME);
    let (tool, by_hand) = (tool.forward(&home).unwrap(), by_hand.forward(&home).unwrap());
    assert!((tool.translation() - by_hand.translation()).norm() < 1e-12);
    // At home the flange looks down.
    assert!((tool.translation().z - (0.374_027_2 - 0.126)).abs() < 1e-6);
}

#[test]
fn limits_are_the_makers() {
    let arm = arm();
    let names: Vec<&str> = arm.joints().iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(
        names,
        ["joint1", "joint2", "joint3", "joint4", "joint5", "joint6", "joint7"]
    );
    let fourth = arm.joints()[3].limits;
    assert_eq!((fourth.lower, fourth.upper), (-0.191_986, 3.926_990));
    let turned = Angles::from([0.0, 0.0, 0.0, -0.3, 0.0, 0.0, 0.0]);
    let error = arm.require_limits(&turned).unwrap_err().to_string();
    assert_eq!(
        error,
        "angle of joint `joint4` is -0.3000 rad, its limits are -0.1920 to 3.9270"
    );
}

fn within_limits() -> impl Strategy<Value = Angles> {
    prop::array::uniform7(0.0_f64..1.0).prop_map(|shares| {
        let joints = arm().joints().clone();
        Angles::from_fn(|joint, _| {
            let limits = joints[joint].limits;
            limits.lower + shares[joint] * (limits.upper - limits.lower)
        })
    })
}

fn distance(one: &RigidTransform, other: &RigidTransform) -> [f64; 2] {
    let apart = (one.translation() - other.translation()).norm();
    [apart, one.rotation().angle_to(&other.rotation())]
}

proptest! {
    #[test]
    fn the_jacobian_is_the_poses_derivative(angles in within_limits()) {
        let arm = arm();
        let (_, jacobian) = arm.jacobian(&angles).unwrap();
        let step = 1e-6;
        for joint in 0..7 {
            let turned = |by: f64| {
                let mut angles = angles;
                angles[joint] += by;
                arm.forward(&angles).unwrap()
            };
            let (after, before) = (turned(step), turned(-step));
            let speed = (after.translation() - before.translation()) / (2.0 * step);
            let spin = (after.rotation() * before.rotation().inverse()).scaled_axis() / (2.0 * step);
            let column = jacobian.column(joint);
            prop_assert!((column.fixed_rows::<3>(0) - speed).norm() < 1e-7);
            prop_assert!((column.fixed_rows::<3>(3) - spin).norm() < 1e-7);
        }
    }

    #[test]
    fn a_reachable_pose_is_reached_within_the_limits(angles in within_limits()) {
        let arm = arm();
        let pose = arm.forward(&angles).unwrap();
        let found = arm.solve(&pose, &Angles::from(HOME), &IkOptions::default()).unwrap();
        let [apart, turned] = distance(&arm.forward(&found.angles).unwrap(), &pose);
        prop_assert!(apart < 1e-6 && turned < 1e-6, "{apart} m, {turned} rad");
        prop_assert!(arm.require_limits(&found.angles).is_ok());
    }

    #[test]
    fn a_near_pose_takes_a_near_way(shift in prop::array::uniform3(-0.03_f64..0.03), turn in prop::array::uniform3(-0.1_f64..0.1)) {
        let (arm, home) = (arm(), Angles::from(HOME));
        let at_home = arm.forward(&home).unwrap();
        let motion = RigidTransform::from_parts(Vector3::from(shift), UnitQuaternion::from_scaled_axis(Vector3::from(turn)));
        let found = arm.solve(&(at_home * motion), &home, &IkOptions::default()).unwrap();
        prop_assert!(found.attempts == 1 && (found.angles - home).amax() < 0.6, "{}", found.angles);
    }
}

#[test]
fn a_joint_is_not_wound_up_by_whole_turns() {
    let arm = arm();
    let seed = Angles::from([5.0, -0.4, -5.5, 0.7, 6.0, 1.1, -6.0]);
    let pose = arm.forward(&seed).unwrap();
    let found = arm.solve(&pose, &seed, &IkOptions::default()).unwrap();
    // The limits push a little; a whole turn is 6.28.
    assert!((found.angles - seed).amax() < 0.1, "{}", found.angles);
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let (arm, home) = (arm(), Angles::from(HOME));
    let options = IkOptions {
        attempts: 20,
        ..IkOptions::default()
    };
    let at = |x: f64| RigidTransform::from_parts(Vector3::new(x, 0.0, 0.3), UnitQuaternion::identity());
    let Err(KinematicsError::Unreachable {
        attempts: 20,
        position_mm,
        ..
    }) = arm.solve(&at(1.5), &home, &options)
    else {
        panic!("1.5 m is out of reach")
    };
    assert!(position_mm > 500.0, "{position_mm}");
    let error = arm.solve(&at(f64::NAN), &home, &options).unwrap_err();
    assert_eq!(error, KinematicsError::PoseNotFinite);
    let mut wrong = home;
    wrong[2] = f64::NAN;
    assert!(arm.forward(&wrong).unwrap_err().to_string().contains("joint3"));
    wrong[2] = 7.0;
    let error = arm.solve(&at(0.4), &wrong, &options).unwrap_err();
    assert!(
        matches!(&error, KinematicsError::OutsideLimits { joint, .. } if joint == "joint3"),
        "{error}"
    );
    let mut rows = nominal();
    rows[4].d = 342.5;
    let error = arm.with_modified_dh(&rows).unwrap_err().to_string();
    assert!(error.contains("joint5") && error.contains("342.5"), "{error}");
}

#[test]
fn a_urdf_without_such_a_way_is_refused_by_name() {
    let robot = robot();
    let error = |base: &str, tip: &str| Chain::<7>::from_urdf(&robot, base, tip).unwrap_err().to_string();
    assert_eq!(error("link_base", "link9"), "the URDF has no link `link9`");
    assert!(error("link3", "link_base").contains("it ends at `link_base`"));
    assert!(error("link2", "link_eef").contains("has 5 joints that turn, expected 7"));
    let mut sliding = robot.clone();
    sliding.joints[1].joint_type = urdf_rs::JointType::Prismatic;
    let error = Chain::<7>::from_urdf(&sliding, "link_base", "link_eef")
        .unwrap_err()
        .to_string();
    assert!(error.contains("joint2") && error.contains("prismatic"), "{error}");
    let mut empty = robot.clone();
    empty.joints[3].limit.upper = empty.joints[3].limit.lower;
    let error = Chain::<7>::from_urdf(&empty, "link_base", "link_eef")
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("joint4: upper limit") || error.contains("`joint4`: upper limit"),
        "{error}"
    );
}

#[test]
fn an_arm_of_six_joints_works_as_well() {
    // The first joint held: what is left has six.
    let mut robot = robot();
    robot.joints[0].joint_type = urdf_rs::JointType::Fixed;
    let arm: Chain<6> = Chain::from_urdf(&robot, "link_base", "link_eef").unwrap();
    let angles = SVector::from([-0.5, 0.2, 0.9, -0.3, 1.2, 0.4]);
    let pose = arm.forward(&angles).unwrap();
    let seed = SVector::from([-0.4, 0.0, 0.7, 0.0, 1.1, 0.0]);
    let found = arm.solve(&pose, &seed, &IkOptions::default()).unwrap();
    let [apart, turned] = distance(&arm.forward(&found.angles).unwrap(), &pose);
    assert!(apart < 1e-6 && turned < 1e-6, "{apart} m, {turned} rad");
}
