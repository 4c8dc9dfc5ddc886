//! The one place where this project's vectors and transforms become those of the collision library, which are glam's.

use geometry::RigidTransform;
use nalgebra::Point3;
pub(crate) use parry3d_f64::math::{Pose, Rotation, Vector};

pub(crate) fn vector(point: &Point3<f64>) -> Vector {
    Vector::new(point.x, point.y, point.z)
}

pub(crate) fn pose(target_from_source: &RigidTransform) -> Pose {
    let translation = target_from_source.translation();
    let [x, y, z, w] = target_from_source.quaternion_xyzw();
    Pose::from_parts(
        Vector::new(translation.x, translation.y, translation.z),
        Rotation::from_xyzw(x, y, z, w),
    )
}
