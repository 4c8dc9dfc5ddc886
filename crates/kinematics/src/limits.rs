//! Joint limits.

use nalgebra::SVector;

use crate::chain::{Chain, Limits};
use crate::error::KinematicsError;

/// A joint that can turn further than this has the same place at another angle, one turn off.
const TURN: f64 = std::f64::consts::TAU;

impl<const N: usize> Chain<N> {
    /// Refuses angles (radians) that are no numbers or outside the limits, and names the first.
    pub fn require_limits(&self, angles: &SVector<f64, N>) -> Result<(), KinematicsError> {
        self.require_finite(angles)?;
        let outside = |(joint, value): &(&crate::Joint, &f64)| !joint.limits.contains(**value);
        match self.joints().iter().zip(angles.iter()).find(outside) {
            None => Ok(()),
            Some((joint, &value)) => Err(KinematicsError::OutsideLimits {
                joint: joint.name.clone(),
                value,
                lower: joint.limits.lower,
                upper: joint.limits.upper,
            }),
        }
    }

    pub(crate) fn require_finite(&self, angles: &SVector<f64, N>) -> Result<(), KinematicsError> {
        let mut pairs = self.joints().iter().zip(angles.iter());
        match pairs.find(|(_, value)| !value.is_finite()) {
            None => Ok(()),
            Some((joint, &value)) => Err(KinematicsError::NotFinite {
                joint: joint.name.clone(),
                value,
            }),
        }
    }

    /// The nearest angles within the limits.
    pub(crate) fn clamped(&self, angles: &SVector<f64, N>) -> SVector<f64, N> {
        SVector::from_fn(|joint, _| {
            let limits = self.joints()[joint].limits;
            angles[joint].clamp(limits.lower, limits.upper)
        })
    }

    /// The same places with every joint turned by whole turns as near to `wanted` as its limits allow.
    pub(crate) fn unwound(&self, angles: &SVector<f64, N>, wanted: &SVector<f64, N>) -> SVector<f64, N> {
        SVector::from_fn(|joint, _| {
            let limits = self.joints()[joint].limits;
            let turns = ((wanted[joint] - angles[joint]) / TURN).round();
            let near = angles[joint] + turns * TURN;
            let candidates = [near, near - TURN, near + TURN, angles[joint]];
            let allowed = candidates.into_iter().filter(|angle| limits.contains(*angle));
            let distance = |angle: &f64| (angle - wanted[joint]).abs();
            let nearest = allowed.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            nearest.unwrap_or(angles[joint])
        })
    }
}

impl Limits {
    /// Whether an angle (radians) is allowed.
    pub fn contains(&self, angle: f64) -> bool {
        (self.lower..=self.upper).contains(&angle)
    }

    pub(crate) fn middle(&self) -> f64 {
        f64::midpoint(self.lower, self.upper)
    }

    pub(crate) fn half_range(&self) -> f64 {
        (self.upper - self.lower) / 2.0
    }
}
