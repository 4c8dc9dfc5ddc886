//! Rotation followed by translation.

use std::ops::Mul;

use nalgebra::{Isometry3, Matrix3, Matrix4, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::error::{GeometryError, require_finite};

/// Largest deviation of a quaternion's length from 1. TF2 accepts the same, so what other nodes take we take too; the
/// quaternion is normalised afterwards.
const QUATERNION_TOLERANCE: f64 = 5e-3;

/// Largest deviation of `R Rᵀ` from the identity in a matrix; files with six decimals pass.
const MATRIX_TOLERANCE: f64 = 1e-5;

/// A rotation followed by a translation in metres, `target_from_source`.
///
/// `base_from_camera * camera_from_object` is `base_from_object`. Points are turned and shifted, directions only turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidTransform {
    isometry: Isometry3<f64>,
}

impl RigidTransform {
    /// Both frames coincide.
    pub fn identity() -> Self {
        Self {
            isometry: Isometry3::identity(),
        }
    }

    /// From parts that are valid by type; the translation is the source's origin in the target, metres.
    pub fn from_parts(translation: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        Self {
            isometry: Isometry3::from_parts(Translation3::from(translation), rotation),
        }
    }

    /// From the values of a TF message: translation in metres, quaternion in the order x, y, z, w.
    ///
    /// Refuses numbers that are not finite and quaternions whose length is not 1 within 0.5 %.
    pub fn from_quaternion_xyzw(translation: [f64; 3], xyzw: [f64; 4]) -> Result<Self, GeometryError> {
        require_finite("translation", &translation)?;
        require_finite("quaternion (x, y, z, w)", &xyzw)?;
        let quaternion = Quaternion::new(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
        let length = quaternion.norm();
        if (length - 1.0).abs() > QUATERNION_TOLERANCE {
            return Err(GeometryError::QuaternionNotUnit {
                xyzw,
                length,
                tolerance: QUATERNION_TOLERANCE,
            });
        }
        Ok(Self::from_parts(
            translation.into(),
            UnitQuaternion::from_quaternion(quaternion),
        ))
    }

    /// From a homogeneous matrix given by rows, as calibration files carry it.
    pub fn from_matrix(rows: &[[f64; 4]; 4]) -> Result<Self, GeometryError> {
        let refuse = |reason, deviation| GeometryError::NotRigid {
            reason,
            deviation,
            tolerance: MATRIX_TOLERANCE,
        };
        require_finite("matrix", rows.as_flattened())?;
        let matrix = Matrix4::from_fn(|row, column| rows[row][column]);
        let last_row = (matrix.row(3) - Matrix4::identity().row(3)).amax();
        if last_row > MATRIX_TOLERANCE {
            return Err(refuse("last row is not 0 0 0 1", last_row));
        }
        let rotation: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
        let skewness = (rotation * rotation.transpose() - Matrix3::identity()).amax();
        if skewness > MATRIX_TOLERANCE {
            return Err(refuse("rotation is not orthonormal", skewness));
        }
        if rotation.determinant() < 0.0 {
            return Err(refuse("rotation is a reflection", 2.0));
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Ok(Self::from_parts(matrix.fixed_view::<3, 1>(0, 3).into(), rotation))
    }

    /// `source_from_target`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self {
            isometry: self.isometry.inverse(),
        }
    }

    /// The pose between `self` (`fraction` 0) and `other` (1): straight line for the origin, shortest arc at constant
    /// rate for the rotation. Half turns apart there is no shortest arc; one of them is taken.
    #[must_use]
    pub fn interpolate(&self, other: &Self, fraction: f64) -> Self {
        let translation = self.translation().lerp(&other.translation(), fraction);
        let (from, to) = (self.rotation(), other.rotation());
        let rotation = from
            .try_slerp(&to, fraction, 1e-9)
            .unwrap_or_else(|| from.nlerp(&to, fraction));
        Self::from_parts(translation, rotation)
    }

    /// The source's origin in the target frame, metres.
    pub fn translation(&self) -> Vector3<f64> {
        self.isometry.translation.vector
    }

    /// Turns source axes into target axes.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.isometry.rotation
    }

    /// The rotation as TF messages carry it.
    pub fn quaternion_xyzw(&self) -> [f64; 4] {
        let coordinates = self.isometry.rotation.coords;
        [coordinates.x, coordinates.y, coordinates.z, coordinates.w]
    }

    /// The rotation as a matrix, for loops over many directions.
    pub fn rotation_matrix(&self) -> Matrix3<f64> {
        *self.isometry.rotation.to_rotation_matrix().matrix()
    }

    /// The same place, expressed in the target frame.
    pub fn transform_point(&self, point_in_source: &Point3<f64>) -> Point3<f64> {
        self.isometry.transform_point(point_in_source)
    }

    /// The same direction, expressed in the target frame; the translation has no part in it.
    pub fn transform_direction(&self, direction_in_source: &Vector3<f64>) -> Vector3<f64> {
        self.isometry.rotation * direction_in_source
    }
}

impl Mul for RigidTransform {
    type Output = Self;

    fn mul(self, source_from_other: Self) -> Self {
        Self {
            isometry: self.isometry * source_from_other.isometry,
        }
    }
}
