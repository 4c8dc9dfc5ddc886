//! Several joints at once.

use crate::error::TrajectoryError;
use crate::limits::JointLimits;
use crate::quintic::{Quintic, State};

/// A minimum-jerk motion from rest to rest reaches these at least: way over duration, over its square, over its cube
/// (15/8; 10/√3; 60).
const SHAPE: [f64; 3] = [1.875, 5.773_502_691_896_258, 60.0];
/// Motions shorter than this are over before they begin, seconds.
const SHORTEST: f64 = 1e-3;
/// Limits hold to this share: the polynomials are evaluated in double precision.
const ROUNDING: f64 = 1e-9;

/// A motion of `N` joints that begin and end together.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion<const N: usize> {
    joints: [Quintic; N],
    duration: f64,
}

impl<const N: usize> Motion<N> {
    /// The fastest minimum-jerk motion from rest to rest that keeps all joints within their limits; all take the same
    /// share of their way at the same time.
    ///
    /// # Errors
    /// Numbers that are not finite, limits that cannot be, an end outside the limits.
    pub fn rest_to_rest(from: &[f64; N], to: &[f64; N], limits: &[JointLimits; N]) -> Result<Self, TrajectoryError> {
        let mut duration = SHORTEST;
        for (index, limits) in limits.iter().enumerate() {
            limits.check(index + 1)?;
            require_within(index + 1, "start", from[index], limits)?;
            require_within(index + 1, "end", to[index], limits)?;
            let way = (to[index] - from[index]).abs();
            let fastest = [
                SHAPE[0] * way / limits.velocity,
                (SHAPE[1] * way / limits.acceleration).sqrt(),
                (SHAPE[2] * way / limits.jerk).cbrt(),
            ];
            duration = fastest.into_iter().fold(duration, f64::max);
        }
        let joint = |index: usize| Quintic::between(State::at(from[index]), State::at(to[index]), duration);
        Ok(Self {
            joints: std::array::from_fn(joint),
            duration,
        })
    }

    /// Seconds.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// The joints' polynomials.
    pub fn joints(&self) -> &[Quintic; N] {
        &self.joints
    }

    /// All joints at a time; before the begin and after the end they rest there.
    pub fn sample(&self, time: f64) -> [State; N] {
        std::array::from_fn(|index| self.joints[index].sample(time))
    }

    /// Whether all limits hold at all times, and if not which one does not.
    pub fn check(&self, limits: &[JointLimits; N]) -> Result<(), TrajectoryError> {
        for (index, (joint, limits)) in self.joints.iter().zip(limits).enumerate() {
            let found = joint.extremes();
            let slack = ROUNDING * (limits.upper - limits.lower);
            let numbers = [
                (
                    "position",
                    found.position[0],
                    limits.lower - slack,
                    limits.upper + slack,
                ),
                (
                    "position",
                    found.position[1],
                    limits.lower - slack,
                    limits.upper + slack,
                ),
                ("speed", found.velocity, 0.0, limits.velocity * (1.0 + ROUNDING)),
                (
                    "acceleration",
                    found.acceleration,
                    0.0,
                    limits.acceleration * (1.0 + ROUNDING),
                ),
                ("jerk", found.jerk, 0.0, limits.jerk * (1.0 + ROUNDING)),
            ];
            for (what, value, least, most) in numbers {
                if !(least..=most).contains(&value) {
                    let joint = index + 1;
                    return Err(TrajectoryError::Outside {
                        joint,
                        what,
                        value,
                        least,
                        most,
                    });
                }
            }
        }
        Ok(())
    }
}

fn require_within(joint: usize, what: &'static str, value: f64, limits: &JointLimits) -> Result<(), TrajectoryError> {
    if !value.is_finite() {
        return Err(TrajectoryError::NotFinite { joint, what, value });
    }
    if (limits.lower..=limits.upper).contains(&value) {
        return Ok(());
    }
    Err(TrajectoryError::Outside {
        joint,
        what,
        value,
        least: limits.lower,
        most: limits.upper,
    })
}
