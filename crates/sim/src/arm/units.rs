//! Between the wire's units (millimetres; roll, pitch, yaw) and the arm's own (metres, transforms).

use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3, Vector6};

use super::model::Joints;

const MM: f64 = 1e-3;

/// x, y, z in millimetres; roll, pitch, yaw in radians about fixed axes.
pub(super) fn pose_of_wire(pose: &[f32; 6]) -> RigidTransform {
    let [x, y, z, roll, pitch, yaw] = pose.map(f64::from);
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    RigidTransform::from_parts(Vector3::new(x, y, z) * MM, rotation)
}

/// The same with a rotation vector instead of the angles.
pub(super) fn axis_angle_of_wire(pose: &[f32; 6]) -> RigidTransform {
    let numbers = Vector6::from(pose.map(f64::from));
    let turn = numbers.fixed_rows::<3>(3).into_owned();
    RigidTransform::from_parts(numbers.fixed_rows::<3>(0) * MM, UnitQuaternion::from_scaled_axis(turn))
}

pub(super) fn pose_to_wire(pose: &RigidTransform) -> [f32; 6] {
    let place = pose.translation() / MM;
    let (roll, pitch, yaw) = pose.rotation().euler_angles();
    [place.x, place.y, place.z, roll, pitch, yaw].map(|value| value as f32)
}

pub(super) fn joints_of_wire(angles: &[f32; 7]) -> Joints {
    angles.map(f64::from)
}

pub(super) fn joints_to_wire(angles: &Joints) -> [f32; 7] {
    angles.map(|angle| angle as f32)
}
