//! Where the redundancy goes.

use nalgebra::SVector;

use crate::chain::{Chain, Jacobian};
use crate::inverse::{damped, manipulability};

/// Damping of the projection, so that it exists at a singularity.
const DAMPING: f64 = 1e-8;
/// Longest step along the redundancy, radians.
const LONGEST_STEP: f64 = 0.3;
/// A shorter one is not worth the way, radians.
const SHORTEST_STEP: f64 = 2e-3;
/// Distance at which the manipulability's slope is taken, radians.
const PROBE: f64 = 1e-3;
/// The limits' cost is this power of the share of the half range: nothing in the middle, steep at the end.
const POWER: i32 = 8;

/// What of the solutions of a pose is preferred, as weights of costs: `½ w |q - seed|²`, `w Σ s⁸ / 8` with s the share
/// of the half range, and `-w ln manipulability`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preference {
    /// Near the seed.
    pub nearness: f64,
    /// Away from the limits.
    pub limits: f64,
    /// Away from singularities.
    pub singularities: f64,
}

impl Default for Preference {
    fn default() -> Self {
        Self {
            nearness: 1.0,
            limits: 0.5,
            singularities: 0.02,
        }
    }
}

impl Preference {
    /// A step to preferred angles that leaves the pose as it is to first order; none when nothing is to be gained.
    pub(crate) fn step<const N: usize>(
        &self,
        chain: &Chain<N>,
        angles: &SVector<f64, N>,
        seed: &SVector<f64, N>,
    ) -> Option<SVector<f64, N>> {
        let (_, jacobian) = chain.tip_and_jacobian(angles);
        let downhill = SVector::from_fn(|joint, _| {
            let limits = chain.joints()[joint].limits;
            let share = (angles[joint] - limits.middle()) / limits.half_range();
            self.nearness * (seed[joint] - angles[joint]) - self.limits * share.powi(POWER - 1) / limits.half_range()
        });
        let free = freed(&jacobian, &downhill)?;
        let direction = free.try_normalize(1e-9)?;
        let slope = downhill.dot(&direction) + self.singularities * opening(chain, angles, &direction);
        let curvature = self.nearness.max(1e-3);
        let length = (slope / curvature).clamp(-LONGEST_STEP, LONGEST_STEP);
        (length.abs() > SHORTEST_STEP).then(|| angles + direction * length)
    }
}

/// The part of a step that leaves the pose as it is.
fn freed<const N: usize>(jacobian: &Jacobian<N>, step: &SVector<f64, N>) -> Option<SVector<f64, N>> {
    Some(step - damped(jacobian, &(jacobian * step), DAMPING)?)
}

/// Slope of the manipulability's logarithm along a direction.
fn opening<const N: usize>(chain: &Chain<N>, angles: &SVector<f64, N>, direction: &SVector<f64, N>) -> f64 {
    let logarithm = |by: f64| {
        let (_, jacobian) = chain.tip_and_jacobian(&(angles + direction * by));
        manipulability(&jacobian).max(1e-12).ln()
    };
    (logarithm(PROBE) - logarithm(-PROBE)) / (2.0 * PROBE)
}
