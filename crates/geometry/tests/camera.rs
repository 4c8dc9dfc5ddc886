//! Projection against its inverse and against hand-computed values; crops and scales; refusals.

use geometry::nalgebra::{Point2, Point3, Vector2};
use geometry::{GeometryError, PinholeCamera, PlumbBob};
use proptest::prelude::*;

fn wrist_camera() -> PinholeCamera {
    PinholeCamera::new(1536, 1536, [2181.8, 2181.8], [770.8, 763.3]).unwrap()
}

fn lens() -> impl Strategy<Value = PlumbBob> {
    (-0.3..0.3, -0.2..0.2, -0.01..0.01, -0.01..0.01, -0.1..0.1).prop_map(|(k1, k2, p1, p2, k3)| PlumbBob {
        k1,
        k2,
        p1,
        p2,
        k3,
    })
}

proptest! {
    #[test]
    fn project_undoes_unproject(lens in lens(), u in 0.0..1535.0, v in 0.0..1535.0, depth in 0.05..2.0) {
        let camera = wrist_camera().with_distortion(lens);
        let pixel = Point2::new(u, v);
        let ray = camera.unproject(&pixel).unwrap();
        let again = camera.project(&Point3::from(ray * depth)).unwrap();
        prop_assert!((again - pixel).norm() < 1e-6, "{pixel} became {again}");
    }

    #[test]
    fn jacobian_agrees_with_differences(lens in lens(), x in -0.4..0.4, y in -0.4..0.4) {
        let (at, h) = (Vector2::new(x, y), 1e-6);
        for (axis, step) in [Vector2::new(h, 0.0), Vector2::new(0.0, h)].into_iter().enumerate() {
            let numeric = (lens.distort(at + step) - lens.distort(at - step)) / (2.0 * h);
            prop_assert!((lens.jacobian(at).column(axis) - numeric).norm() < 1e-8);
        }
    }

    #[test]
    fn a_crop_sees_the_same_rays(lens in lens(), x in 0_usize..1000, y in 0_usize..1000, u in 0.0..500.0, v in 0.0..500.0) {
        let camera = wrist_camera().with_distortion(lens);
        let part = camera.crop(x, y, 512, 512).unwrap();
        let here = part.unproject(&Point2::new(u, v)).unwrap();
        let there = camera.unproject(&Point2::new(u + x as f64, v + y as f64)).unwrap();
        prop_assert!((here - there).norm() < 1e-9);
    }

    #[test]
    fn binning_undoes_enlarging(factor in 1_usize..8) {
        let camera = wrist_camera();
        let again = camera.enlarged(factor).unwrap().binned(factor).unwrap();
        prop_assert_eq!((again.width(), again.height()), (camera.width(), camera.height()));
        prop_assert!((again.principal()[0] - camera.principal()[0]).abs() < 1e-9);
        prop_assert!((again.focal()[1] - camera.focal()[1]).abs() < 1e-9);
    }
}

#[test]
fn coefficients_come_in_the_order_k1_k2_p1_p2_k3() {
    let k = [1000.0, 0.0, 500.0, 0.0, 1000.0, 400.0, 0.0, 0.0, 1.0];
    let camera =
        PinholeCamera::from_camera_info(1000, 800, &k, "plumb_bob", &[-0.1, 0.02, 0.003, -0.004, 0.005]).unwrap();
    // By hand: x = 0.2, y = 0.1, r² = 0.05, radial = 1 - 0.005 + 0.00005 + 0.000000625.
    let radial = 0.995_050_625;
    let x = 0.2 * radial + 2.0 * 0.003 * 0.02 - 0.004 * (0.05 + 0.08);
    let y = 0.1 * radial + 0.003 * (0.05 + 0.02) + 2.0 * -0.004 * 0.02;
    let pixel = camera.project(&Point3::new(0.4, 0.2, 2.0)).unwrap();
    assert!((pixel - Point2::new(500.0 + 1000.0 * x, 400.0 + 1000.0 * y)).norm() < 1e-9);
}

#[test]
fn enlarging_keeps_a_pixel_centre_in_its_block() {
    let big = wrist_camera().enlarged(3).unwrap();
    let ray = wrist_camera().unproject(&Point2::new(100.0, 200.0)).unwrap();
    let pixel = big.project(&Point3::from(ray)).unwrap();
    assert!(
        (pixel - Point2::new(301.0, 601.0)).norm() < 1e-9,
        "the middle of three pixels from 300, 600, got {pixel}"
    );
}

#[test]
fn nothing_behind_the_camera_projects() {
    assert_eq!(wrist_camera().project(&Point3::new(0.1, 0.1, 0.0)), None);
    assert_eq!(wrist_camera().project(&Point3::new(0.1, 0.1, -1.0)), None);
}

#[test]
fn a_folded_lens_is_refused_not_guessed() {
    let folded = wrist_camera().with_distortion(PlumbBob {
        k1: -2.0,
        ..PlumbBob::default()
    });
    // x_d = x - 2 x³ never exceeds 0.272, which is 594 px from the centre.
    let error = folded.unproject(&Point2::new(1500.0, 763.3)).unwrap_err();
    assert!(matches!(error, GeometryError::NotUndistortable { .. }), "{error}");
    let nowhere = folded.unproject(&Point2::new(f64::NAN, 0.0)).unwrap_err();
    assert!(matches!(nowhere, GeometryError::NotUndistortable { .. }), "{nowhere}");
}

#[test]
fn unusable_cameras_are_refused_with_their_values() {
    let info = |k: [f64; 9], model: &str, d: &[f64]| PinholeCamera::from_camera_info(10, 10, &k, model, d).unwrap_err();
    let good = [9.0, 0.0, 5.0, 0.0, 9.0, 5.0, 0.0, 0.0, 1.0];
    assert!(info([0.0; 9], "plumb_bob", &[]).to_string().contains("uncalibrated"));
    assert!(info(good, "equidistant", &[0.0; 4]).to_string().contains("equidistant"));
    assert!(
        info(good, "plumb_bob", &[0.0; 3])
            .to_string()
            .contains("3 coefficients")
    );
    assert!(matches!(
        info([9.0, 0.1, 5.0, 0.0, 9.0, 5.0, 0.0, 0.0, 1.0], "", &[]),
        GeometryError::CameraMatrix { .. }
    ));
    assert!(matches!(
        wrist_camera().crop(1000, 0, 537, 10),
        Err(GeometryError::CropOutside { .. })
    ));
    assert!(matches!(
        wrist_camera().crop(usize::MAX, 0, 2, 10),
        Err(GeometryError::CropOutside { .. })
    ));
    assert!(matches!(wrist_camera().binned(5), Err(GeometryError::Scale { .. })));
    assert!(matches!(wrist_camera().enlarged(0), Err(GeometryError::Scale { .. })));
}
