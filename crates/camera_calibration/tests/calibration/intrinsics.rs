//! Lenses from views of a target, against the lens that made them.

use crate::rendering::{Picture, target_at};
use crate::scenes::{apart, corners, held_targets, wrist_camera};
use camera_calibration::{
    CameraCalibrationError, CameraOptions, CameraViews, CharucoTarget, FixedLens, LensPart, Shortfall, TargetDetector,
    TargetView, calibrate_camera, calibrate_cameras,
};
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

const TARGET: CharucoTarget = CharucoTarget::A4;

fn seen(camera: &PinholeCamera, poses: &[RigidTransform], noise: f64) -> CameraViews {
    let mut random = fastrand::Rng::with_seed(17);
    let view = |(index, pose): (usize, &RigidTransform)| TargetView {
        name: format!("view {index}"),
        corners: corners(&TARGET, camera, pose, noise, &mut random),
    };
    CameraViews {
        camera: "c1".into(),
        size: [camera.width(), camera.height()],
        views: poses.iter().enumerate().map(view).collect(),
    }
}

fn refused(seen: &CameraViews) -> CameraCalibrationError {
    calibrate_camera(&TARGET, seen, &CameraOptions::default()).unwrap_err()
}

#[test]
fn fifteen_pictures_give_the_lens_and_every_pose() {
    let camera = wrist_camera();
    let detector = TargetDetector::new(&TARGET).unwrap();
    let poses = held_targets(&TARGET, 15, 2);
    let view = |(index, pose): (usize, &RigidTransform)| {
        let picture = Picture {
            seed: index as u64,
            ..Picture::USUAL
        };
        TargetView {
            name: format!("view {index}"),
            corners: detector.detect(&picture.take(&TARGET, &camera, pose)).unwrap(),
        }
    };
    let seen = CameraViews {
        camera: "c1".into(),
        size: [768, 768],
        views: poses.iter().enumerate().map(view).collect(),
    };
    let found = calibrate_camera(&TARGET, &seen, &CameraOptions::default()).unwrap();
    let ([fx, fy], [cx, cy]) = (found.camera.focal(), found.camera.principal());
    let ([true_fx, true_fy], [true_cx, true_cy]) = (camera.focal(), camera.principal());
    println!(
        "RMS {:.4} px, coverage {:.2}, {:?}",
        found.rms_px,
        found.coverage.share(),
        found.camera
    );
    println!("deviations {:?}", found.deviations);
    assert!(
        (fx / true_fx - 1.0).abs() < 1e-3 && (fy / true_fy - 1.0).abs() < 1e-3,
        "{fx} {fy}"
    );
    assert!((cx - true_cx).abs() < 1.0 && (cy - true_cy).abs() < 1.0, "{cx} {cy}");
    let mut worst: [f64; 2] = [0.0; 2];
    for (view, truth) in found.views.iter().zip(&poses) {
        let off = apart(&view.camera_from_target.unwrap(), truth);
        worst = [worst[0].max(off[0]), worst[1].max(off[1].to_degrees())];
    }
    println!("worst pose: {:.3} mm, {:.4} degrees", 1e3 * worst[0], worst[1]);
    assert!(worst[0] < 0.2e-3 && worst[1] < 0.02, "{worst:?}");
    assert_eq!(found.shortfalls, []);
}

#[test]
fn the_deviations_are_as_large_as_the_errors() {
    let camera = wrist_camera();
    let mut squares = [0.0; 4];
    let runs = 20;
    for run in 0..runs {
        let poses = held_targets(&TARGET, 12, 100 + run);
        let mut views = seen(&camera, &poses, 0.0);
        let mut random = fastrand::Rng::with_seed(run);
        for (view, pose) in views.views.iter_mut().zip(&poses) {
            view.corners = corners(&TARGET, &camera, pose, 0.1, &mut random);
        }
        let found = calibrate_camera(&TARGET, &views, &CameraOptions::default()).unwrap();
        let numbers = |camera: &PinholeCamera| [camera.focal(), camera.principal()].concat();
        let pairs = numbers(&found.camera).into_iter().zip(numbers(&camera));
        for (index, (found_value, truth)) in pairs.enumerate() {
            squares[index] += ((found_value - truth) / found.deviations[index]).powi(2) / f64::from(runs as u32);
        }
    }
    // Chi-square of 20 samples: outside 0.37 to 2.0 once in a thousand.
    assert!(squares.iter().all(|square| (0.3..2.2).contains(square)), "{squares:?}");
}

#[test]
fn a_few_wild_corners_change_nothing() {
    let camera = wrist_camera();
    let mut views = seen(&camera, &held_targets(&TARGET, 12, 4), 0.03);
    let clean = calibrate_camera(&TARGET, &views, &CameraOptions::default()).unwrap();
    for view in &mut views.views {
        view.corners[20].pixel.x += 9.0;
        view.corners[21].pixel.y -= 6.0;
    }
    let found = calibrate_camera(&TARGET, &views, &CameraOptions::default()).unwrap();
    for axis in 0..2 {
        assert!(
            (found.camera.focal()[axis] - clean.camera.focal()[axis]).abs() < 0.5,
            "{found:?}"
        );
    }
    // But the views are not called good.
    assert!(
        matches!(found.shortfalls[..], [Shortfall::Residual { .. }]),
        "{:?}",
        found.shortfalls
    );
}

#[test]
fn what_is_fixed_stays() {
    let camera = PinholeCamera::new(768, 768, [1090.9, 1090.9], [383.5, 383.5]).unwrap();
    let views = seen(&camera, &held_targets(&TARGET, 9, 6), 0.05);
    let options = CameraOptions {
        fixed: FixedLens::of(&[
            LensPart::Principal,
            LensPart::K1,
            LensPart::K2,
            LensPart::Tangential,
            LensPart::K3,
        ]),
        ..CameraOptions::default()
    };
    let found = calibrate_camera(&TARGET, &views, &options).unwrap();
    assert_eq!(
        (found.camera.principal(), found.camera.distortion()),
        ([383.5, 383.5], PlumbBob::default())
    );
    assert!((found.camera.focal()[0] - 1090.9).abs() < 0.5);
    assert_eq!(found.deviations[2..], [0.0; 7]);
}

#[test]
fn views_that_do_not_tell_the_lens_are_refused() {
    let camera = wrist_camera();
    let one = refused(&seen(&camera, &held_targets(&TARGET, 1, 1), 0.0)).to_string();
    assert_eq!(one, "c1: 1 views can be used, needed are 3 at least");

    let place = held_targets(&TARGET, 2, 1);
    let again = refused(&seen(&camera, &[place[0], place[1], place[0]], 0.02)).to_string();
    assert!(
        again.contains("view 2: the target is where it was in view 0"),
        "{again}"
    );

    let flat: Vec<_> = (0..9)
        .map(|i| f64::from(i) * 0.01 - 0.04)
        .map(|at| target_at(&TARGET, [0.0, 0.0, 9.0 * at], [at, -at, 0.35 + at]))
        .collect();
    for noise in [0.0, 0.05] {
        let parallel = refused(&seen(&camera, &flat, noise)).to_string();
        assert!(parallel.contains("tilt"), "{parallel}");
    }
}

#[test]
fn a_calibration_that_falls_short_says_what_to_do() {
    let camera = wrist_camera();
    let corner: Vec<_> = (0..6)
        .map(|i| f64::from(i) * 0.1)
        .map(|at| target_at(&TARGET, [at - 0.2, 0.1, at], [-0.12, -0.12, 0.62 - 0.1 * at]))
        .collect();
    let found = calibrate_camera(&TARGET, &seen(&camera, &corner, 0.03), &CameraOptions::default()).unwrap();
    let said: Vec<String> = found.shortfalls.iter().map(ToString::to_string).collect();
    let said = said.join("\n");
    assert!(said.contains("6 views are used, needed are 8: take 2 more"), "{said}");
    assert!(said.contains("move the target to the "), "{said}");
    assert!(said.contains("right") || said.contains("bottom"), "{said}");
}

#[test]
fn the_last_view_can_be_taken_back() {
    let mut views = seen(&wrist_camera(), &held_targets(&TARGET, 3, 1), 0.0);
    let before = views.clone();
    let extra = TargetView {
        name: "blurred".into(),
        corners: Vec::new(),
    };
    views.views.push(extra);
    assert_eq!(views.without_last_view(), before);
}

#[test]
fn two_cameras_are_found_with_their_places_to_each_other() {
    let first = wrist_camera();
    let second = PinholeCamera::new(768, 768, [1454.5, 1454.0], [380.0, 388.0]).unwrap();
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.05, -0.3, 0.1));
    let first_from_second = RigidTransform::from_parts(Vector3::new(0.11, -0.02, 0.01), turn);
    let poses = held_targets(&TARGET, 14, 12);
    let there: Vec<_> = poses.iter().map(|pose| first_from_second.inverse() * *pose).collect();
    let mut views = [seen(&first, &poses, 0.05), seen(&second, &there, 0.05)];
    views[1].camera = "c2".into();
    for camera in &mut views {
        camera.views.retain(|view| view.corners.len() >= 20);
    }
    assert!(views[1].views.len() >= 6, "{}", views[1].views.len());
    let found = calibrate_cameras(&TARGET, &views, &[CameraOptions::default(); 2]).unwrap();
    let [shift, angle] = apart(&found.others[0].pose, &first_from_second);
    println!(
        "{:.3} mm, {:.4} degrees, deviations {:?}",
        1e3 * shift,
        angle.to_degrees(),
        found.others[0].deviations
    );
    assert!(shift < 0.5e-3 && angle.to_degrees() < 0.05, "{shift} {angle}");
    assert!(
        shift < 4.0 * found.others[0].deviations[1],
        "{shift} {:?}",
        found.others[0].deviations
    );
    assert!((found.cameras[1].camera.focal()[0] / 1454.5 - 1.0).abs() < 1e-3);

    for view in &mut views[1].views {
        view.name.push_str(" of another time");
    }
    let error = calibrate_cameras(&TARGET, &views, &[CameraOptions::default(); 2]).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("c1 and c2 saw the target together in 0 views"),
        "{error}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn exact_points_give_the_exact_lens(
        seed in 0_u64..1000,
        focal in 900.0_f64..1500.0,
        aspect in 0.98_f64..1.02,
        off in prop::array::uniform2(-20.0_f64..20.0),
        k1 in -0.2_f64..0.2,
        k2 in -0.1_f64..0.1,
        p in prop::array::uniform2(-0.002_f64..0.002),
    ) {
        let camera = PinholeCamera::new(768, 768, [focal, focal * aspect], [383.5 + off[0], 383.5 + off[1]]).unwrap();
        let camera = camera.with_distortion(PlumbBob { k1, k2, p1: p[0], p2: p[1], k3: 0.0 });
        let found = calibrate_camera(&TARGET, &seen(&camera, &held_targets(&TARGET, 10, seed), 0.0), &CameraOptions::default());
        let found = found.unwrap();
        prop_assert!((found.camera.focal()[0] - focal).abs() < 1e-3, "{:?} {camera:?}", found.camera);
        prop_assert!((found.camera.principal()[1] - 383.5 - off[1]).abs() < 1e-3);
        prop_assert!((found.camera.distortion().k1 - k1).abs() < 1e-4);
        prop_assert!(found.rms_px < 1e-6);
    }
}
