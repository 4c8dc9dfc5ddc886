//! The mean of poses.

use geometry::RigidTransform;
use nalgebra::{Matrix3, Vector3};

use crate::homography::nearest_rotation;

/// The mean of the origins, and the rotation nearest to the mean of the rotation matrices; none without poses.
pub(crate) fn mean_pose(poses: &[RigidTransform]) -> Option<RigidTransform> {
    let count = poses.len() as f64;
    let rotation: Matrix3<f64> = poses.iter().map(RigidTransform::rotation_matrix).sum();
    let translation: Vector3<f64> = poses.iter().map(RigidTransform::translation).sum();
    if poses.is_empty() {
        return None;
    }
    Some(RigidTransform::from_parts(
        translation / count,
        nearest_rotation(&rotation)?,
    ))
}
