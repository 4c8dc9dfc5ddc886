//! Several joints over one piece of time.

use crate::error::TrajectoryError;
use crate::limits::{JointLimits, ROUNDING};
use crate::quintic::{Extremes, Quintic, State};

/// `N` quintic polynomials over the same duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<const N: usize> {
    joints: [Quintic; N],
    duration: f64,
}

impl<const N: usize> Segment<N> {
    /// From some states to others in `duration` seconds.
    ///
    /// # Errors
    /// Numbers that are not finite; a duration that is not more than 0.
    pub fn between(from: &[State; N], to: &[State; N], duration: f64) -> Result<Self, TrajectoryError> {
        if !(duration.is_finite() && duration > 0.0) {
            return Err(TrajectoryError::Duration { value: duration });
        }
        for (index, (from, to)) in from.iter().zip(to).enumerate() {
            from.require_finite(index + 1)?;
            to.require_finite(index + 1)?;
        }
        Ok(Self::new(from, to, duration))
    }

    /// From states and a duration that are known to be good.
    pub(crate) fn new(from: &[State; N], to: &[State; N], duration: f64) -> Self {
        Self {
            joints: std::array::from_fn(|index| Quintic::between(from[index], to[index], duration)),
            duration,
        }
    }

    /// Seconds.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// The joints' polynomials.
    pub fn joints(&self) -> &[Quintic; N] {
        &self.joints
    }

    /// All joints at a time, seconds from the segment's begin; outside the segment the states at its ends.
    pub fn sample(&self, time: f64) -> [State; N] {
        std::array::from_fn(|index| self.joints[index].sample(time))
    }

    /// The same way in `factor` times the time, more than 0.
    #[must_use]
    pub fn slowed(&self, factor: f64) -> Self {
        Self {
            joints: std::array::from_fn(|index| self.joints[index].slowed(factor)),
            duration: self.duration * factor,
        }
    }

    /// Whether all limits hold at all times, and if not which one does not.
    pub fn check(&self, limits: &[JointLimits; N]) -> Result<(), TrajectoryError> {
        for (index, (joint, limits)) in self.joints.iter().zip(limits).enumerate() {
            check_joint(index + 1, &joint.extremes(), limits)?;
        }
        Ok(())
    }

    /// How many times the duration is needed for speed, acceleration and jerk to keep the limits; less than 1 when there
    /// is room.
    pub(crate) fn pace(&self, limits: &[JointLimits; N]) -> f64 {
        let of_joint = |(joint, limits): (&Quintic, &JointLimits)| {
            let found = joint.extremes();
            let velocity = found.velocity / limits.velocity;
            let acceleration = (found.acceleration / limits.acceleration).sqrt();
            velocity.max(acceleration).max((found.jerk / limits.jerk).cbrt())
        };
        self.joints.iter().zip(limits).map(of_joint).fold(0.0, f64::max)
    }
}

fn check_joint(joint: usize, found: &Extremes, limits: &JointLimits) -> Result<(), TrajectoryError> {
    let slack = ROUNDING * (limits.upper - limits.lower);
    let (lower, upper) = (limits.lower - slack, limits.upper + slack);
    let up_to = |limit: f64| limit * (1.0 + ROUNDING);
    let numbers = [
        ("position", found.position[0], lower, upper),
        ("position", found.position[1], lower, upper),
        ("speed", found.velocity, 0.0, up_to(limits.velocity)),
        ("acceleration", found.acceleration, 0.0, up_to(limits.acceleration)),
        ("jerk", found.jerk, 0.0, up_to(limits.jerk)),
    ];
    for (what, value, least, most) in numbers {
        if !(least..=most).contains(&value) {
            return Err(TrajectoryError::Outside {
                joint,
                what,
                value,
                least,
                most,
            });
        }
    }
    Ok(())
}
