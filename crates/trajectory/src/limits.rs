//! What joints can do.

use kinematics::Chain;

use crate::error::TrajectoryError;

/// Limits hold to this share: the polynomials are evaluated in double precision.
pub(crate) const ROUNDING: f64 = 1e-9;

/// What a joint can do: radians and seconds, or metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Smallest position.
    pub lower: f64,
    /// Largest position.
    pub upper: f64,
    /// Largest speed, more than 0.
    pub velocity: f64,
    /// Largest acceleration, more than 0.
    pub acceleration: f64,
    /// Largest jerk, more than 0.
    pub jerk: f64,
}

impl JointLimits {
    /// Refuses limits that are no numbers, zero or negative; `joint` is the number to name, 1 for the first.
    pub fn check(&self, joint: usize) -> Result<(), TrajectoryError> {
        let positive = [
            ("velocity", self.velocity),
            ("acceleration", self.acceleration),
            ("jerk", self.jerk),
        ];
        for (what, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                let allowed = "finite and more than 0";
                return Err(TrajectoryError::Limit {
                    joint,
                    what,
                    value,
                    allowed,
                });
            }
        }
        if !(self.lower.is_finite() && self.upper.is_finite() && self.lower < self.upper) {
            let (what, value, allowed) = ("position", self.upper, "finite, the upper one above the lower");
            return Err(TrajectoryError::Limit {
                joint,
                what,
                value,
                allowed,
            });
        }
        Ok(())
    }

    pub(crate) fn require_within(&self, joint: usize, what: &'static str, value: f64) -> Result<(), TrajectoryError> {
        if !value.is_finite() {
            return Err(TrajectoryError::NotFinite { joint, what, value });
        }
        if (self.lower..=self.upper).contains(&value) {
            return Ok(());
        }
        Err(TrajectoryError::Outside {
            joint,
            what,
            value,
            least: self.lower,
            most: self.upper,
        })
    }
}

/// What an arm can do: its joints, and its tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrajectoryLimits<const N: usize> {
    /// Joint by joint, from the base on.
    pub joints: [JointLimits; N],
    /// Largest speed of the tool's origin, metres per second, more than 0. An xArm7 in servo mode trips near 1 m/s.
    pub tool_speed: f64,
}

impl<const N: usize> TrajectoryLimits<N> {
    /// Positions and speeds as the chain's URDF gives them; acceleration (rad/s²) and jerk (rad/s³), which a URDF does
    /// not hold, the same for all joints; tool speed in m/s. For an xArm7 its maker names 20 rad/s² as the most that a
    /// command may ask for; the jerk in servo mode is left to who commands it, and 200 to 500 rad/s³ reach that
    /// acceleration in 40 to 100 ms.
    ///
    /// # Errors
    /// Numbers that are not finite or not more than 0.
    pub fn of_chain(chain: &Chain<N>, acceleration: f64, jerk: f64, tool_speed: f64) -> Result<Self, TrajectoryError> {
        let joint = |index: usize| {
            let known = chain.joints()[index].limits;
            JointLimits {
                lower: known.lower,
                upper: known.upper,
                velocity: known.velocity,
                acceleration,
                jerk,
            }
        };
        let limits = Self {
            joints: std::array::from_fn(joint),
            tool_speed,
        };
        limits.check()?;
        Ok(limits)
    }

    /// Refuses limits that are no numbers, zero or negative.
    pub fn check(&self) -> Result<(), TrajectoryError> {
        for (index, joint) in self.joints.iter().enumerate() {
            joint.check(index + 1)?;
        }
        let value = self.tool_speed;
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        Err(TrajectoryError::Argument {
            what: "tool speed limit",
            value,
            allowed: "finite and more than 0 m/s",
        })
    }
}
