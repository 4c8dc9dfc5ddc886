//! Lookups against composition by hand, properties, and every refusal; no wires.

use std::time::Duration;

use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3};
use interfaces::geometry_msgs::msg::TransformStamped;
use proptest::prelude::*;

use super::*;

fn shift(x: f64, y: f64, z: f64) -> RigidTransform {
    RigidTransform::from_parts(Vector3::new(x, y, z), UnitQuaternion::identity())
}

fn turn_z(angle: f64) -> RigidTransform {
    RigidTransform::from_parts(Vector3::zeros(), UnitQuaternion::from_euler_angles(0.0, 0.0, angle))
}

fn moving(buffer: &Buffer, parent: &str, child: &str, stamp: i64, transform: RigidTransform) -> Result<(), TfError> {
    buffer.insert(&StampedTransform::new(parent, child, stamp, transform))
}

fn fixed(buffer: &Buffer, parent: &str, child: &str, transform: RigidTransform) -> Result<(), TfError> {
    buffer.insert_static(&StampedTransform::new(parent, child, 0, transform))
}

fn assert_near(found: &RigidTransform, expected: &RigidTransform) {
    let difference = found.inverse() * *expected;
    let error = difference.translation().norm() + difference.rotation().angle();
    assert!(error < 1e-6, "{found:?} is not {expected:?}");
}

/// `link_base` - `link_eef` (moving) - `c1_optical_frame`, and `link_base` - `c2_optical_frame`.
fn cell() -> Buffer {
    let buffer = Buffer::default();
    moving(&buffer, "link_base", "link_eef", 1_000, shift(0.0, 0.0, 1.0)).unwrap();
    moving(&buffer, "link_base", "link_eef", 2_000, shift(1.0, 0.0, 1.0)).unwrap();
    fixed(&buffer, "link_eef", "c1_optical_frame", turn_z(0.5)).unwrap();
    fixed(&buffer, "link_base", "c2_optical_frame", shift(0.0, 2.0, 0.0)).unwrap();
    buffer
}

#[test]
fn lookups_go_up_down_and_across_the_tree() {
    let buffer = cell();
    let eef_at_1500 = shift(0.5, 0.0, 1.0);
    assert_near(&buffer.lookup("link_base", "link_eef", 1_500).unwrap(), &eef_at_1500);
    assert_near(
        &buffer.lookup("link_eef", "link_base", 1_500).unwrap(),
        &eef_at_1500.inverse(),
    );
    let expected = shift(0.0, -2.0, 0.0) * eef_at_1500 * turn_z(0.5);
    assert_near(
        &buffer.lookup("c2_optical_frame", "c1_optical_frame", 1_500).unwrap(),
        &expected,
    );
    assert_near(
        &buffer.lookup("link_eef", "link_eef", 1_500).unwrap(),
        &RigidTransform::identity(),
    );
    // Nothing moves between these two, so any time will do.
    assert_near(
        &buffer.lookup("link_eef", "c1_optical_frame", 9_000).unwrap(),
        &turn_z(0.5),
    );
}

#[test]
fn unknown_frames_are_an_error_even_when_asked_for_themselves() {
    let buffer = cell();
    let expected = "frame \"gripper\" is unknown; known: c1_optical_frame, c2_optical_frame, link_base, link_eef";
    for (target, source) in [
        ("gripper", "link_base"),
        ("link_base", "gripper"),
        ("gripper", "gripper"),
    ] {
        assert_eq!(buffer.lookup(target, source, 1_500).unwrap_err().to_string(), expected);
    }
    let error = Buffer::default().lookup("a", "b", 0).unwrap_err().to_string();
    assert_eq!(error, "frame \"a\" is unknown; known: none");
}

#[test]
fn separate_trees_are_an_error() {
    let buffer = cell();
    fixed(&buffer, "map", "mat", shift(1.0, 0.0, 0.0)).unwrap();
    let error = buffer.lookup("link_eef", "mat", 1_500).unwrap_err().to_string();
    assert_eq!(
        error,
        "frames \"link_eef\" and \"mat\" are not connected: their roots are \"link_base\" and \"map\""
    );
}

#[test]
fn past_and_future_are_errors_with_the_known_interval() {
    let buffer = cell();
    for time in [999, 2_001] {
        let error = buffer.lookup("link_base", "c1_optical_frame", time).unwrap_err();
        let expected = format!(
            "no transform from \"link_eef\" to \"link_base\" at 0.00000{time:04} s: \
             known from 0.000001000 s to 0.000002000 s"
        );
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn the_latest_common_time_is_that_of_the_slowest_frame() {
    let buffer = cell();
    moving(&buffer, "link_eef", "cup", 1_200, shift(0.0, 0.0, 0.1)).unwrap();
    moving(&buffer, "link_eef", "cup", 1_600, shift(0.0, 0.0, 0.1)).unwrap();
    let (transform, time) = buffer.lookup_latest("link_base", "cup").unwrap();
    assert_eq!(time, 1_600);
    assert_near(&transform, &shift(0.6, 0.0, 1.1));
    assert_eq!(buffer.lookup_latest("link_base", "c2_optical_frame").unwrap().1, 0);

    moving(&buffer, "link_base", "late", 5_000, shift(0.0, 0.0, 0.1)).unwrap();
    let error = buffer.lookup_latest("late", "cup").unwrap_err();
    assert!(
        matches!(
            error,
            TfError::NoCommonTime {
                from: 5_000,
                until: 1_600,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn circles_and_second_parents_are_refused() {
    let buffer = cell();
    let error = fixed(&buffer, "c1_optical_frame", "link_base", turn_z(0.1))
        .unwrap_err()
        .to_string();
    let circle = "link_base on c1_optical_frame on link_eef on link_base";
    assert_eq!(
        error,
        format!("\"link_base\" on \"c1_optical_frame\" closes a circle: {circle}")
    );
    let error = fixed(&buffer, "x", "x", turn_z(0.1)).unwrap_err();
    assert!(matches!(error, TfError::Cycle { .. }), "{error}");
    let error = moving(&buffer, "map", "link_eef", 3_000, turn_z(0.1))
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "\"link_eef\" hangs on \"link_base\" and cannot hang on \"map\" as well"
    );
    let error = fixed(&buffer, "link_base", "link_eef", turn_z(0.1)).unwrap_err();
    assert!(matches!(error, TfError::StaticAndMoving { .. }), "{error}");
    let error = fixed(&buffer, "", "x", turn_z(0.1)).unwrap_err();
    assert!(matches!(error, TfError::Unnamed { .. }), "{error}");
    assert_near(
        &buffer.lookup("link_base", "link_eef", 2_000).unwrap(),
        &shift(1.0, 0.0, 1.0),
    );
}

#[test]
fn ten_seconds_are_kept() {
    const SECOND: i64 = 1_000_000_000;
    let buffer = Buffer::default();
    for second in 0..=30 {
        moving(&buffer, "a", "b", second * SECOND, shift(second as f64, 0.0, 0.0)).unwrap();
    }
    assert!(buffer.lookup("a", "b", 20 * SECOND).is_ok());
    let error = buffer.lookup("a", "b", 20 * SECOND - 1).unwrap_err().to_string();
    assert!(
        error.ends_with("known from 20.000000000 s to 30.000000000 s"),
        "{error}"
    );
    let error = moving(&buffer, "a", "b", 19 * SECOND, shift(0.0, 0.0, 0.0)).unwrap_err();
    assert!(matches!(error, TfError::TooOld { .. }), "{error}");
    // Out of order, but within reach.
    moving(&buffer, "a", "b", 25 * SECOND + 1, shift(7.0, 0.0, 0.0)).unwrap();
    assert_near(
        &buffer.lookup("a", "b", 25 * SECOND + 1).unwrap(),
        &shift(7.0, 0.0, 0.0),
    );
}

#[test]
fn after_a_jump_static_frames_stay() {
    let buffer = cell();
    buffer.forget_moving();
    assert!(matches!(
        buffer.lookup("link_base", "link_eef", 1_500),
        Err(TfError::NotConnected { .. })
    ));
    assert!(buffer.lookup("link_base", "c2_optical_frame", 1_500).is_ok());
    moving(&buffer, "link_base", "link_eef", 10, shift(0.0, 0.0, 1.0)).unwrap();
    assert!(buffer.lookup("link_base", "link_eef", 10).is_ok());
}

#[test]
fn messages_that_are_no_rigid_transform_are_refused() {
    let mut message = TransformStamped {
        child_frame_id: "b".into(),
        ..TransformStamped::default()
    };
    message.header.frame_id = "a".into();
    message.transform.rotation.w = 0.0;
    let error = StampedTransform::from_message(&message).unwrap_err().to_string();
    assert!(
        error.starts_with("the transform from \"b\" to \"a\" is not valid: quaternion"),
        "{error}"
    );
    message.transform.rotation.w = 1.0;
    message.transform.translation.x = f64::NAN;
    assert!(matches!(
        StampedTransform::from_message(&message),
        Err(TfError::Invalid { .. })
    ));
}

#[tokio::test(start_paused = true)]
async fn waiting_ends_with_the_transform_or_with_what_is_missing() {
    let buffer = cell();
    let arrive = async { moving(&buffer, "link_base", "link_eef", 3_000, shift(2.0, 0.0, 1.0)).unwrap() };
    let waiting = buffer.wait_for("link_base", "link_eef", 2_500, Duration::from_mins(1));
    let (found, ()) = tokio::join!(waiting, arrive);
    assert_near(&found.unwrap(), &shift(1.5, 0.0, 1.0));
    assert_eq!(
        buffer
            .wait_for_latest("link_base", "link_eef", Duration::ZERO)
            .await
            .unwrap()
            .1,
        3_000
    );

    let error = buffer
        .wait_for("link_base", "gripper", 0, Duration::from_secs(2))
        .await
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("waited 2s in vain: frame \"gripper\" is unknown; known: c1_"),
        "{error}"
    );
}

prop_compose! {
    fn transforms()(t in prop::array::uniform3(-2.0..2.0), axis_angle in prop::array::uniform3(-1.7..1.7)) -> RigidTransform {
        RigidTransform::from_parts(t.into(), UnitQuaternion::from_scaled_axis(Vector3::from(axis_angle)))
    }
}

proptest! {
    #[test]
    fn a_lookup_is_the_product_along_the_way(a in transforms(), b in transforms(), c in transforms()) {
        let buffer = Buffer::default();
        moving(&buffer, "root", "a", 5, a).unwrap();
        fixed(&buffer, "a", "b", b).unwrap();
        moving(&buffer, "root", "c", 5, c).unwrap();
        assert_near(&buffer.lookup("c", "b", 5).unwrap(), &(c.inverse() * a * b));
    }

    #[test]
    fn turning_target_and_source_round_inverts(a in transforms(), b in transforms()) {
        let buffer = Buffer::default();
        moving(&buffer, "root", "a", 5, a).unwrap();
        moving(&buffer, "root", "b", 5, b).unwrap();
        let (there, back) = (buffer.lookup("a", "b", 5).unwrap(), buffer.lookup("b", "a", 5).unwrap());
        assert_near(&(there * back), &RigidTransform::identity());
    }

    #[test]
    fn interpolation_is_in_proportion(a in transforms(), b in transforms(), time in 0_i64..=1_000) {
        let buffer = Buffer::default();
        moving(&buffer, "root", "a", 0, a).unwrap();
        moving(&buffer, "root", "a", 1_000, b).unwrap();
        let found = buffer.lookup("root", "a", time).unwrap();
        let fraction = time as f64 / 1_000.0;
        let along = (b.translation() - a.translation()) * fraction;
        prop_assert!((found.translation() - a.translation() - along).norm() < 1e-9);
        let (turned, whole) = (a.rotation().angle_to(&found.rotation()), a.rotation().angle_to(&b.rotation()));
        prop_assert!((turned - whole * fraction).abs() < 1e-6);
    }

    #[test]
    fn messages_carry_transforms_unchanged(transform in transforms(), stamp in 0_i64..4_000_000_000_000_000_000) {
        let stamp = stamp.min(i64::from(i32::MAX) * 1_000_000_000);
        let sent = StampedTransform::new("a", "b", stamp, transform);
        let received = StampedTransform::from_message(&sent.to_message()).unwrap();
        prop_assert_eq!((&received.parent, &received.child, received.stamp), (&sent.parent, &sent.child, stamp));
        assert_near(&received.parent_from_child, &transform);
    }
}
