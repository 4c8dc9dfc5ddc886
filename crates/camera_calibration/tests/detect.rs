//! Targets in rendered pictures, against where they truly are.

mod common;

use camera_calibration::{CharucoTarget, NotFound, TargetDetector};
use common::Picture;
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use imaging::Image;
use nalgebra::{UnitQuaternion, Vector3};

fn camera() -> PinholeCamera {
    let lens = PlumbBob {
        k1: -0.12,
        k2: 0.08,
        p1: 0.0008,
        p2: -0.0005,
        k3: 0.0,
    };
    PinholeCamera::new(768, 768, [1090.9, 1090.9], [385.4, 381.6]).unwrap().with_distortion(lens)
}

/// The target's middle on the optical axis, turned.
fn pose(turn: [f64; 3], distance: f64) -> RigidTransform {
    let rotation = UnitQuaternion::from_euler_angles(turn[0], turn[1], turn[2]);
    let [width, height] = CharucoTarget::A4.size();
    let middle = Vector3::new(width / 2.0, height / 2.0, 0.0);
    RigidTransform::from_parts(Vector3::new(0.0, 0.0, distance) - rotation * middle, rotation)
}

#[test]
fn corners_are_where_they_were_drawn_to_a_few_hundredths_of_a_pixel() {
    let (target, camera) = (CharucoTarget::A4, camera());
    let detector = TargetDetector::new(&target).unwrap();
    for (turn, distance) in [([0.0, 0.0, 0.1], 0.32), ([0.5, 0.2, 0.8], 0.36), ([-0.4, 0.5, -2.0], 0.45)] {
        let camera_from_target = pose(turn, distance);
        let image = Picture::USUAL.take(&target, &camera, &camera_from_target);
        let found = detector.detect(&image).unwrap();
        let mut squares = 0.0;
        let mut mean = nalgebra::Vector2::zeros();
        let mut worst: f64 = 0.0;
        for corner in &found {
            let point = target.corner(corner.id).unwrap();
            let truth = camera.project(&camera_from_target.transform_point(&point)).unwrap();
            let off = corner.pixel - truth;
            squares += off.norm_squared();
            mean += off / found.len() as f64;
            worst = worst.max(off.norm());
        }
        let rms = (squares / found.len() as f64).sqrt();
        println!("{} corners, RMS {rms:.4} px, mean {mean:?}, worst {worst:.3}", found.len());
        assert!(found.len() >= 60, "{}", found.len());
        assert!(rms < 0.06 && worst < 0.25 && mean.norm() < 0.01, "{rms} {worst} {mean:?}");
    }
}

#[test]
fn without_a_target_it_is_said_what_is_missing() {
    let detector = TargetDetector::new(&CharucoTarget::A4).unwrap();
    let dark = Image::filled(320, 240, 7_u16);
    assert_eq!(detector.detect(&dark), Err(NotFound::Blank { brightness: 7 }));
    let mut random = fastrand::Rng::with_seed(3);
    let noise = Image::new(320, 240, (0..320 * 240).map(|_| random.u16(..)).collect()).unwrap();
    let error = detector.detect(&noise).unwrap_err();
    assert!(error.to_string().contains("13 x 9 squares of 15.0 mm"), "{error}");

    // Another board of the same kind: its markers are in another order.
    let other = CharucoTarget::new(9, 7, 0.02, 0.012).unwrap();
    let camera_from_target = pose([0.1, 0.0, 0.0], 0.32);
    let image = Picture::USUAL.take(&other, &camera(), &camera_from_target);
    let error = detector.detect(&image).unwrap_err();
    assert!(matches!(error, NotFound::NoBoard { .. } | NotFound::FewCorners { .. }), "{error}");
}
