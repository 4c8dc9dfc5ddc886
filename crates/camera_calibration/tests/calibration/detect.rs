//! Targets in rendered pictures, against where they truly are.

use crate::rendering::{Picture, target_at};
use crate::scenes::wrist_camera;
use camera_calibration::{CharucoTarget, NotFound, TargetDetector};
use imaging::Image;

#[test]
fn corners_are_where_they_were_drawn_to_a_few_hundredths_of_a_pixel() {
    let (target, camera) = (CharucoTarget::A4, wrist_camera());
    let detector = TargetDetector::new(&target).unwrap();
    for (turn, distance) in [
        ([0.0, 0.0, 0.1], 0.32),
        ([0.5, 0.2, 0.8], 0.36),
        ([-0.4, 0.5, -2.0], 0.45),
    ] {
        let camera_from_target = target_at(&target, turn, [0.0, 0.0, distance]);
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
        println!(
            "{} corners, RMS {rms:.4} px, mean {mean:?}, worst {worst:.3}",
            found.len()
        );
        assert!(found.len() >= 60, "{}", found.len());
        assert!(
            rms < 0.06 && worst < 0.25 && mean.norm() < 0.01,
            "{rms} {worst} {mean:?}"
        );
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
    let camera_from_target = target_at(&other, [0.1, 0.0, 0.0], [0.0, 0.0, 0.32]);
    let image = Picture::USUAL.take(&other, &wrist_camera(), &camera_from_target);
    let error = detector.detect(&image).unwrap_err();
    assert!(
        matches!(error, NotFound::NoBoard { .. } | NotFound::FewCorners { .. }),
        "{error}"
    );
}
