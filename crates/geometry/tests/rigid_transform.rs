//! Laws of rigid transforms on random poses, and what is refused.

use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};
use geometry::{GeometryError, RigidTransform};
use proptest::prelude::*;

fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-limit..limit).prop_map(Vector3::from)
}

fn transform() -> impl Strategy<Value = RigidTransform> {
    (vector(5.0), vector(3.0)).prop_map(|(t, r)| RigidTransform::from_parts(t, UnitQuaternion::from_scaled_axis(r)))
}

fn distance(a: &RigidTransform, b: &RigidTransform) -> f64 {
    (a.translation() - b.translation()).norm() + a.rotation().angle_to(&b.rotation())
}

proptest! {
    #[test]
    fn neighbours_cancel(base_from_camera in transform(), camera_from_object in transform(), p in vector(1.0)) {
        let point_in_object = Point3::from(p);
        let base_from_object = base_from_camera * camera_from_object;
        let step_by_step = base_from_camera.transform_point(&camera_from_object.transform_point(&point_in_object));
        prop_assert!((base_from_object.transform_point(&point_in_object) - step_by_step).norm() < 1e-12);
    }

    #[test]
    fn inverse_undoes(base_from_camera in transform()) {
        let there_and_back = base_from_camera.inverse() * base_from_camera;
        prop_assert!(distance(&there_and_back, &RigidTransform::identity()) < 1e-7);
    }

    #[test]
    fn quaternion_round_trip(pose in transform()) {
        let again = RigidTransform::from_quaternion_xyzw(pose.translation().into(), pose.quaternion_xyzw()).unwrap();
        prop_assert!(distance(&pose, &again) < 1e-7);
    }

    #[test]
    fn matrix_round_trip(pose in transform()) {
        let (r, t) = (pose.rotation_matrix(), pose.translation());
        let row = |i: usize| [r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]];
        let again = RigidTransform::from_matrix(&[row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]).unwrap();
        prop_assert!(distance(&pose, &again) < 1e-7);
    }

    #[test]
    fn directions_ignore_the_origin(pose in transform(), p in vector(1.0), direction in vector(1.0)) {
        let moved = pose.transform_point(&Point3::from(p + direction)) - pose.transform_point(&Point3::from(p));
        prop_assert!((pose.transform_direction(&direction) - moved).norm() < 1e-12);
    }

    #[test]
    fn interpolation_meets_both_ends_and_keeps_the_rate(from in transform(), to in transform(), fraction in 0.0..1.0) {
        prop_assert!(distance(&from.interpolate(&to, 0.0), &from) < 1e-7);
        prop_assert!(distance(&from.interpolate(&to, 1.0), &to) < 1e-7);
        let between = from.interpolate(&to, fraction);
        let (part, whole) = (from.rotation().angle_to(&between.rotation()), from.rotation().angle_to(&to.rotation()));
        prop_assert!((part - fraction * whole).abs() < 1e-6, "{part} of {whole} at {fraction}");
        let straight = from.translation() + (to.translation() - from.translation()) * fraction;
        prop_assert!((between.translation() - straight).norm() < 1e-12);
    }
}

#[test]
fn a_half_turn_interpolates_to_something_finite() {
    let from = RigidTransform::identity();
    let to = RigidTransform::from_quaternion_xyzw([1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).unwrap();
    let middle = from.interpolate(&to, 0.5);
    assert!(middle.quaternion_xyzw().iter().all(|x| x.is_finite()));
    assert!((middle.translation().x - 0.5).abs() < 1e-12);
}

#[test]
fn forgotten_and_broken_quaternions_are_refused() {
    let zero = RigidTransform::from_quaternion_xyzw([0.0; 3], [0.0; 4]).unwrap_err();
    assert!(zero.to_string().contains("length 0.000000"), "{zero}");
    let long = RigidTransform::from_quaternion_xyzw([0.0; 3], [0.0, 0.0, 0.0, 1.01]).unwrap_err();
    assert!(matches!(long, GeometryError::QuaternionNotUnit { length, .. } if (length - 1.01).abs() < 1e-12));
    let nan = RigidTransform::from_quaternion_xyzw([0.0, f64::NAN, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap_err();
    assert!(matches!(
        nan,
        GeometryError::NotFinite {
            what: "translation",
            ..
        }
    ));
    let rounded = RigidTransform::from_quaternion_xyzw([0.0; 3], [0.0, 0.0, 0.0, 1.001]).unwrap();
    assert!((rounded.rotation().norm() - 1.0).abs() < 1e-12);
}

#[test]
fn matrices_that_are_not_rigid_are_refused() {
    let with_diagonal = |x: f64, y: f64, z: f64| {
        RigidTransform::from_matrix(&[[x, 0., 0., 0.], [0., y, 0., 0.], [0., 0., z, 0.], [0., 0., 0., 1.]])
    };
    assert!(with_diagonal(1.0, 1.0, 1.0).is_ok());
    assert!(
        with_diagonal(1.0, 1.0, 1.1)
            .unwrap_err()
            .to_string()
            .contains("orthonormal")
    );
    assert!(
        with_diagonal(1.0, 1.0, -1.0)
            .unwrap_err()
            .to_string()
            .contains("reflection")
    );
}
