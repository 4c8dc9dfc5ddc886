//! One arm's own dimensions.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::chain::Chain;
use crate::error::KinematicsError;

/// Modified Denavit-Hartenberg parameters of a joint (Craig, "Introduction to Robotics", 1986, section 3.4):
/// `parent_from_joint = Rx(alpha) · Tx(a) · Rz(theta + angle) · Tz(d)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModifiedDh {
    /// Added to the joint's angle, radians.
    pub theta: f64,
    /// Along the joint's axis, metres.
    pub d: f64,
    /// Turn from the axis before to this one, radians.
    pub alpha: f64,
    /// From the axis before to this one, metres.
    pub a: f64,
}

/// Arms are smaller than this, metres.
const LARGEST: f64 = 5.0;

impl<const N: usize> Chain<N> {
    /// The same arm with its own dimensions instead of the nominal ones; names, limits and tip stay. All joints then turn
    /// about their z axis.
    ///
    /// # Errors
    /// A parameter that is no number, or metres that cannot be an arm's.
    pub fn with_modified_dh(self, parameters: &[ModifiedDh; N]) -> Result<Self, KinematicsError> {
        for (joint, row) in self.joints().iter().zip(parameters) {
            let numbers = [
                ("theta", row.theta, f64::INFINITY),
                ("alpha", row.alpha, f64::INFINITY),
                ("d", row.d, LARGEST),
                ("a", row.a, LARGEST),
            ];
            for (what, value, most) in numbers {
                if !(value.is_finite() && value.abs() <= most) {
                    return Err(KinematicsError::JointNumber {
                        joint: joint.name.clone(),
                        what,
                        value,
                        allowed: "finite radians, metres from -5 to 5",
                    });
                }
            }
        }
        Ok(self.with_origins(parameters.map(|row| row.origin())))
    }
}

impl ModifiedDh {
    /// At joint angle 0.
    fn origin(&self) -> Isometry3<f64> {
        let about = |axis: &nalgebra::Unit<Vector3<f64>>, angle| UnitQuaternion::from_axis_angle(axis, angle);
        let along = Isometry3::from_parts(Translation3::identity(), about(&Vector3::x_axis(), self.alpha))
            * Translation3::new(self.a, 0.0, self.d);
        along * about(&Vector3::z_axis(), self.theta)
    }
}
