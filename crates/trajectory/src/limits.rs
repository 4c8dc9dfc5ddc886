//! What joints can do.

use crate::error::TrajectoryError;

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
}
