//! From rest to rest.

use crate::error::TrajectoryError;
use crate::limits::JointLimits;
use crate::quintic::{Quintic, State};
use crate::segment::Segment;

/// A minimum-jerk motion from rest to rest reaches these at least: way over duration, over its square, over its cube
/// (15/8; 10/√3; 60).
const SHAPE: [f64; 3] = [1.875, 5.773_502_691_896_258, 60.0];
/// Motions that go nowhere last this long, seconds.
pub(crate) const SHORTEST: f64 = 1e-3;

/// A motion of `N` joints from rest to rest that begin and end together.
///
/// ```
/// use trajectory::{JointLimits, Motion};
///
/// let limits = [JointLimits { lower: -3.0, upper: 3.0, velocity: 2.0, acceleration: 10.0, jerk: 100.0 }; 2];
/// let motion = Motion::rest_to_rest(&[0.0, 1.0], &[1.0, -1.0], &limits)?;
/// assert_eq!(motion.check(&limits), Ok(()));
/// let end = motion.sample(motion.duration());
/// assert!((end[1].position + 1.0).abs() < 1e-9 && end[1].velocity.abs() < 1e-9);
/// # Ok::<(), trajectory::TrajectoryError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<const N: usize> {
    segment: Segment<N>,
}

impl<const N: usize> Motion<N> {
    /// The fastest minimum-jerk motion from rest to rest that keeps all joints within their limits; all take the same
    /// share of their way at the same time. One that goes nowhere lasts a millisecond.
    ///
    /// # Errors
    /// Numbers that are not finite, limits that cannot be, an end outside the limits.
    pub fn rest_to_rest(from: &[f64; N], to: &[f64; N], limits: &[JointLimits; N]) -> Result<Self, TrajectoryError> {
        let mut duration = SHORTEST;
        for (index, limits) in limits.iter().enumerate() {
            limits.check(index + 1)?;
            limits.require_within(index + 1, "start", from[index])?;
            limits.require_within(index + 1, "end", to[index])?;
            let way = (to[index] - from[index]).abs();
            let fastest = [
                SHAPE[0] * way / limits.velocity,
                (SHAPE[1] * way / limits.acceleration).sqrt(),
                (SHAPE[2] * way / limits.jerk).cbrt(),
            ];
            duration = fastest.into_iter().fold(duration, f64::max);
        }
        Ok(Self {
            segment: Segment::new(&from.map(State::at), &to.map(State::at), duration),
        })
    }

    /// Seconds.
    pub fn duration(&self) -> f64 {
        self.segment.duration()
    }

    /// The joints' polynomials.
    pub fn joints(&self) -> &[Quintic; N] {
        self.segment.joints()
    }

    /// As a piece of a trajectory.
    pub fn segment(&self) -> &Segment<N> {
        &self.segment
    }

    /// All joints at a time; before the begin and after the end they rest there.
    pub fn sample(&self, time: f64) -> [State; N] {
        self.segment.sample(time)
    }

    /// Whether all limits hold at all times, and if not which one does not.
    pub fn check(&self, limits: &[JointLimits; N]) -> Result<(), TrajectoryError> {
        self.segment.check(limits)
    }
}
