//! Hand-eye poses on the cell's arm, whose joints are not quite where they say.

use camera_calibration::{
    CharucoTarget, DetectedCorner, EyeInHand, HandEyeThresholds, HandEyeView, SceneCamera, SceneView, Shortfall,
    calibrate_eye_in_hand, calibrate_eye_to_hand,
};
use geometry::{PinholeCamera, RigidTransform};
use kinematics::{Chain, IkOptions};
use nalgebra::{SVector, UnitQuaternion, Vector3};

use crate::rendering::{normal, target_at};
use crate::scenes::{apart, corners, wrist_camera};

const TARGET: CharucoTarget = CharucoTarget::A4;
/// Standard deviation of a corner, pixels.
const PIXELS: f64 = 0.05;

/// The cell's arm with its flange, and joints that are off by a little at every stand.
struct Arm {
    chain: Chain<7>,
    random: fastrand::Rng,
    joint_noise: f64,
}

impl Arm {
    fn new(joint_noise: f64) -> Self {
        let robot = urdf_rs::read_file(concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/xarm7.urdf")).unwrap();
        Self {
            chain: Chain::from_urdf(&robot, "link_base", "link_eef").unwrap(),
            random: fastrand::Rng::with_seed(11),
            joint_noise,
        }
    }

    /// Where the flange is, and where the arm says it is.
    fn go(&mut self, base_from_flange: &RigidTransform) -> (RigidTransform, RigidTransform) {
        let seed = SVector::from([0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]);
        let said = self
            .chain
            .solve(base_from_flange, &seed, &IkOptions::default())
            .unwrap()
            .angles;
        let noise = self.joint_noise;
        let true_angles = said.map(|angle| angle + noise * normal(&mut self.random));
        (
            self.chain.forward(&true_angles).unwrap(),
            self.chain.forward(&said).unwrap(),
        )
    }

    fn see(&mut self, camera: &PinholeCamera, camera_from_target: &RigidTransform) -> Vec<DetectedCorner> {
        corners(&TARGET, camera, camera_from_target, PIXELS, &mut self.random)
    }
}

fn pose(turn: [f64; 3], shift: [f64; 3]) -> RigidTransform {
    RigidTransform::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn.into()))
}

/// About where the cell's drawing has the wrist camera.
fn flange_from_camera() -> RigidTransform {
    pose([0.05, -0.02, 1.55], [0.07, 0.01, 0.03])
}

fn base_from_target() -> RigidTransform {
    pose([3.1, 0.03, 0.0], [0.33, 0.07, 0.002])
}

/// Cameras above the target, looking at it from all sides.
fn stands(target: &RigidTransform, count: usize) -> Vec<RigidTransform> {
    let camera = |index: usize| {
        let angle = index as f64 * 2.4;
        let tilt = 0.45 * (index as f64 / count as f64).sqrt();
        let turn = [tilt * angle.cos(), tilt * angle.sin(), 0.5 * (1.7 * angle).sin()];
        let place = [
            0.02 * angle.sin(),
            0.02 * angle.cos(),
            0.33 + 0.02 * (0.9 * angle).cos(),
        ];
        *target * target_at(&TARGET, turn, place).inverse()
    };
    (0..count).map(camera).collect()
}

fn eye_in_hand_views(arm: &mut Arm, camera: &PinholeCamera, target: &RigidTransform, count: usize) -> Vec<HandEyeView> {
    let view = |(index, base_from_camera): (usize, RigidTransform)| {
        let (is, says) = arm.go(&(base_from_camera * flange_from_camera().inverse()));
        HandEyeView {
            name: format!("stand {index}"),
            base_from_flange: says,
            corners: arm.see(camera, &((is * flange_from_camera()).inverse() * *target)),
            placement: 0,
        }
    };
    stands(target, count).into_iter().enumerate().map(view).collect()
}

fn in_hand(views: &[HandEyeView]) -> Result<EyeInHand, camera_calibration::CameraCalibrationError> {
    calibrate_eye_in_hand(&TARGET, &wrist_camera(), views, None, &HandEyeThresholds::default())
}

#[test]
fn a_camera_on_the_flange_is_found_with_joints_that_are_off() {
    let camera = wrist_camera();
    // 0.006 degrees a joint: some 0.1 mm at the flange, as repeatable as such arms are.
    let mut arm = Arm::new(1e-4);
    let views = eye_in_hand_views(&mut arm, &camera, &base_from_target(), 15);
    let found = in_hand(&views).unwrap();
    let [shift, angle] = apart(&found.flange_from_camera.pose, &flange_from_camera());
    println!(
        "{:.3} mm, {:.4} degrees, {:?}",
        1e3 * shift,
        angle.to_degrees(),
        found.flange_from_camera.deviations
    );
    let report = &found.report;
    println!(
        "RMS {:.3} px, {:.3} mm, {:.4} px in the images",
        report.rms_px,
        1e3 * report.rms,
        report.image_rms_px
    );
    assert!(shift < 0.2e-3 && angle.to_degrees() < 0.02, "{shift} {angle}");
    let [turn_deviation, shift_deviation] = found.flange_from_camera.deviations;
    assert!(
        shift < 4.0 * shift_deviation && angle < 4.0 * turn_deviation,
        "{:?}",
        found.flange_from_camera
    );
    let (number, placed) = &found.placements[0];
    let [shift, angle] = apart(&placed.pose, &base_from_target());
    assert!(
        *number == 0 && shift < 0.3e-3 && angle.to_degrees() < 0.03,
        "{shift} {angle}"
    );
    assert_eq!(found.report.shortfalls, []);
}

#[test]
fn without_noise_the_pose_is_exact() {
    let camera = wrist_camera();
    let mut arm = Arm::new(0.0);
    let mut views = eye_in_hand_views(&mut arm, &camera, &base_from_target(), 9);
    for view in &mut views {
        let truth = (view.base_from_flange * flange_from_camera()).inverse() * base_from_target();
        view.corners = corners(&TARGET, &camera, &truth, 0.0, &mut arm.random);
    }
    let [shift, angle] = apart(&in_hand(&views).unwrap().flange_from_camera.pose, &flange_from_camera());
    assert!(shift < 1e-7 && angle < 1e-7, "{shift} {angle}");
}

#[test]
fn the_deviations_of_a_pose_are_as_large_as_its_errors() {
    let camera = wrist_camera();
    let mut arm = Arm::new(2e-4);
    let (mut squares, runs) = ([0.0; 2], 16);
    for _ in 0..runs {
        let views = eye_in_hand_views(&mut arm, &camera, &base_from_target(), 15);
        let found = in_hand(&views).unwrap().flange_from_camera;
        let [shift, angle] = apart(&found.pose, &flange_from_camera());
        squares[0] += (angle / found.deviations[0]).powi(2) / f64::from(runs);
        squares[1] += (shift / found.deviations[1]).powi(2) / f64::from(runs);
    }
    // Mean of 16 chi-squares of three numbers each, of mean 1.
    assert!(squares.iter().all(|square| (0.4..2.0).contains(square)), "{squares:?}");
}

#[test]
fn a_standing_camera_is_found_by_a_target_on_the_flange() {
    let camera = PinholeCamera::new(768, 768, [1454.5, 1454.5], [380.0, 388.0]).unwrap();
    let base_from_camera = pose([2.2, 2.2, 0.1], [0.35, 0.05, 0.75]);
    // On a plate that reaches out, its back to the flange.
    let flange_from_target = pose([0.0, 3.1, 0.1], [0.09, -0.06, 0.05]);
    let mut arm = Arm::new(1e-4);
    let view = |index: usize| {
        let angle = index as f64 * 2.4;
        let tilt = 0.4 * (index as f64 / 15.0).sqrt();
        let turn = [tilt * angle.cos(), tilt * angle.sin(), 0.4 * (1.7 * angle).sin()];
        let camera_from_target = target_at(&TARGET, turn, [0.01 * angle.sin(), 0.01 * angle.cos(), 0.42]);
        let wanted = base_from_camera * camera_from_target * flange_from_target.inverse();
        let (is, says) = arm.go(&wanted);
        HandEyeView {
            name: format!("stand {index}"),
            base_from_flange: says,
            corners: arm.see(&camera, &(base_from_camera.inverse() * is * flange_from_target)),
            placement: 0,
        }
    };
    let views: Vec<HandEyeView> = (0..15).map(view).collect();
    let found = calibrate_eye_to_hand(&TARGET, &camera, &views, &HandEyeThresholds::default()).unwrap();
    let [shift, angle] = apart(&found.base_from_camera.pose, &base_from_camera);
    println!(
        "{:.3} mm, {:.4} degrees, {:?}",
        1e3 * shift,
        angle.to_degrees(),
        found.base_from_camera.deviations
    );
    assert!(shift < 0.4e-3 && angle.to_degrees() < 0.04, "{shift} {angle}");
    assert!(shift < 4.0 * found.base_from_camera.deviations[1]);
    assert_eq!(found.report.shortfalls, []);
}

#[test]
fn a_camera_over_the_table_is_found_by_targets_that_both_see() {
    let (camera, scene_lens) = (
        wrist_camera(),
        PinholeCamera::new(768, 768, [1454.5, 1454.5], [380.0, 388.0]).unwrap(),
    );
    let base_from_scene = base_from_target() * target_at(&TARGET, [0.2, -0.3, 0.9], [0.0, 0.01, 0.42]).inverse();
    let mut arm = Arm::new(1e-4);
    let (mut views, mut scene_views) = (Vec::new(), Vec::new());
    for placement in 0..3 {
        let off = placement as f64 - 1.0;
        let target = base_from_target() * pose([0.2 * off, 0.1 * off, 0.3 * off], [0.01 * off, 0.02, 0.0]);
        for mut view in eye_in_hand_views(&mut arm, &camera, &target, 6) {
            view.placement = placement;
            view.name = format!("placement {placement}, {}", view.name);
            views.push(view);
        }
        let name = format!("placement {placement}");
        let seen = arm.see(&scene_lens, &(base_from_scene.inverse() * target));
        let twice = [name.clone(), format!("{name} again")];
        scene_views.extend(twice.map(|name| SceneView {
            name,
            corners: seen.clone(),
            placement,
        }));
    }
    let scene = SceneCamera {
        name: "c2",
        camera: &scene_lens,
        views: &scene_views,
    };
    let thresholds = HandEyeThresholds::default();
    let found = calibrate_eye_in_hand(&TARGET, &camera, &views, Some(scene), &thresholds).unwrap();
    let placed = found.scene.unwrap();
    let [shift, angle] = apart(&placed.pose, &base_from_scene);
    println!(
        "{:.3} mm, {:.4} degrees, {:?}",
        1e3 * shift,
        angle.to_degrees(),
        placed.deviations
    );
    assert!(
        shift < 0.5e-3 && angle.to_degrees() < 0.05 && placed.views == 3,
        "{shift} {angle}"
    );
    let again = found
        .report
        .views
        .iter()
        .find(|view| view.name == "placement 1 again")
        .unwrap();
    assert_eq!(again.left_out.as_deref(), Some("its placement is in an earlier view"));

    for view in &mut scene_views {
        view.placement = 9;
    }
    let scene = SceneCamera {
        name: "c2",
        camera: &scene_lens,
        views: &scene_views,
    };
    let error = calibrate_eye_in_hand(&TARGET, &camera, &views, Some(scene), &thresholds).unwrap_err();
    assert!(
        error.to_string().starts_with("c2 saw the target at no place"),
        "{error}"
    );
}

#[test]
fn stands_that_do_not_tell_the_pose_are_refused() {
    let camera = wrist_camera();
    let mut arm = Arm::new(0.0);
    let views = eye_in_hand_views(&mut arm, &camera, &base_from_target(), 3);
    let same: Vec<_> = [0, 1, 0, 1].map(|index: usize| views[index].clone()).into();
    let error = in_hand(&same).unwrap_err().to_string();
    assert!(
        error.contains("2 views can be used") && error.contains("the arm stood where it stood in stand 0"),
        "{error}"
    );

    let down = target_at(&TARGET, [0.0; 3], [0.0, 0.0, 0.35]);
    let about_one = |index: usize| {
        let turn = pose([0.0, 0.0, 0.2 * index as f64], [0.01 * index as f64, 0.0, 0.0]);
        let base_from_camera = base_from_target() * (turn * down).inverse();
        let (is, says) = arm.go(&(base_from_camera * flange_from_camera().inverse()));
        HandEyeView {
            name: format!("stand {index}"),
            base_from_flange: says,
            corners: arm.see(&camera, &((is * flange_from_camera()).inverse() * base_from_target())),
            placement: 0,
        }
    };
    let one_axis: Vec<HandEyeView> = (0..8).map(about_one).collect();
    let error = in_hand(&one_axis).unwrap_err().to_string();
    assert!(
        error.contains("second axis") && error.contains("turn it about two axes"),
        "{error}"
    );
}

#[test]
fn poses_of_other_images_are_noticed() {
    let camera = wrist_camera();
    let mut views = eye_in_hand_views(&mut Arm::new(1e-4), &camera, &base_from_target(), 12);
    let first = views[0].base_from_flange;
    views[0].base_from_flange = views[5].base_from_flange;
    views[5].base_from_flange = first;
    let report = in_hand(&views).unwrap().report;
    let said = report
        .shortfalls
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join("\n");
    assert!(
        report
            .shortfalls
            .iter()
            .any(|short| matches!(short, Shortfall::Place { .. })),
        "{said}"
    );
    assert!(said.contains("stand 0") || said.contains("stand 5"), "{said}");
}

#[test]
fn the_camera_of_the_tests_looks_at_the_target() {
    let camera = stands(&base_from_target(), 1)[0];
    let axis = camera.rotation() * Vector3::z();
    assert!(axis.z < -0.9, "{axis:?}");
}
