//! The last gate before the arm.

use kinematics::Chain;
use nalgebra::{SVector, Vector3};

use crate::error::TrajectoryError;
use crate::limits::{ROUNDING, TrajectoryLimits};
use crate::quintic::State;

/// Differences of third order of numbers near 1, over a period of a millisecond: what rounding makes of them, rad/s³.
const NOISE: f64 = 1e-5;
/// Share by which the tool may be faster than its limit: a set-point that was brought back moves the tool a little
/// differently.
const TOOL_SLACK: f64 = 1e-3;

/// Share of what a set-point was put right by that is left after a period, in the long run.
const FADING: f64 = 0.75;

/// Why a set-point was not passed on. Joints are numbered from 1.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GuardFault {
    /// A number that is none.
    #[error("joint {joint}: the set-point is {value}, expected a finite number")]
    NotFinite {
        /// Its number.
        joint: usize,
        /// As asked for.
        value: f64,
    },
    /// A position outside the limits.
    #[error("joint {joint}: the set-point is {value:.6}, allowed are {least:.6} to {most:.6}")]
    Position {
        /// Its number.
        joint: usize,
        /// As asked for, radians.
        value: f64,
        /// Radians.
        least: f64,
        /// Radians.
        most: f64,
    },
    /// Further from what limits allow than may be put right.
    #[error(
        "joint {joint}: the set-point asks for {what} {value:.4}, allowed are {allowed:.4}; it is off by {off:.6} rad"
    )]
    Rate {
        /// Its number.
        joint: usize,
        /// Speed, acceleration or jerk: the one that is exceeded most.
        what: &'static str,
        /// From the set-points passed before; per second, per second squared or cubed.
        value: f64,
        /// Largest one allowed.
        allowed: f64,
        /// To the nearest set-point within the limits, radians.
        off: f64,
    },
    /// A tool that is too fast.
    #[error("the set-point moves the tool at {value:.4} m/s, allowed are {allowed:.4}")]
    ToolSpeed {
        /// Metres per second.
        value: f64,
        /// Largest one allowed.
        allowed: f64,
    },
}

/// Lets set-points pass to the arm that keep its limits, one per control period.
///
/// Speed, acceleration and jerk are differences of the set-points passed before. For a trajectory sampled at the period
/// they are means of its true ones over one to three periods, hence never beyond the limits that it keeps. A set-point
/// that is off what the limits allow by at most `correction` is brought back to it, and those after it return to what is
/// wanted within some 20 periods; one that is further off is refused, and the arm stays where it was sent last.
///
/// After a fault, [`SetPointGuard::states`] is where a [`crate::Stop`] begins. Its speeds and accelerations are estimated
/// from the set-points; give the stop a jerk a little below the guard's. Nothing allocates.
#[derive(Debug, Clone)]
pub struct SetPointGuard<const N: usize> {
    chain: Chain<N>,
    limits: TrajectoryLimits<N>,
    period: f64,
    correction: f64,
    joints: [Passed; N],
    tool: Vector3<f64>,
}

/// Of one joint: the last set-point, and the differences that led to it.
#[derive(Debug, Clone, Copy, Default)]
struct Passed {
    position: f64,
    velocity: f64,
    acceleration: f64,
    jerk: f64,
    /// How far the last set-points were from those wanted, newest first, radians.
    off: [f64; 3],
}

impl<const N: usize> SetPointGuard<N> {
    /// For an arm that rests at `start`; `period` in seconds (0.004 for an xArm7), `correction` in radians.
    ///
    /// # Errors
    /// Limits, a period or a correction that cannot be; a start that is not finite or outside the limits.
    pub fn new(
        chain: Chain<N>,
        limits: TrajectoryLimits<N>,
        period: f64,
        correction: f64,
        start: &[f64; N],
    ) -> Result<Self, TrajectoryError> {
        limits.check()?;
        if !(period.is_finite() && period > 0.0) {
            return Err(TrajectoryError::Duration { value: period });
        }
        crate::blend::require_tolerance("guard's correction", correction)?;
        let mut guard = Self {
            chain,
            limits,
            period,
            correction,
            joints: [Passed::default(); N],
            tool: Vector3::zeros(),
        };
        guard.rest_at(start)?;
        Ok(guard)
    }

    /// Begins anew with an arm that rests at `start`: after a pause, or when something else has moved it.
    ///
    /// # Errors
    /// A start that is not finite or outside the limits.
    pub fn rest_at(&mut self, start: &[f64; N]) -> Result<(), TrajectoryError> {
        for (index, (limits, position)) in self.limits.joints.iter().zip(start).enumerate() {
            limits.require_within(index + 1, "start", *position)?;
        }
        self.tool = self.chain.forward(&SVector::from(*start))?.translation();
        self.joints = start.map(|position| Passed {
            position,
            ..Passed::default()
        });
        Ok(())
    }

    /// Called once each control period: what may be sent to the arm for what is wanted.
    ///
    /// # Errors
    /// Why nothing may be sent; the guard is then as it was before.
    pub fn pass(&mut self, wanted: &[f64; N]) -> Result<[f64; N], GuardFault> {
        let passed = self.pass_joints(wanted)?;
        let tool = self.tool_at(&passed);
        let (value, allowed) = ((tool - self.tool).norm() / self.period, self.limits.tool_speed);
        if value > allowed * (1.0 + TOOL_SLACK) {
            return Err(GuardFault::ToolSpeed { value, allowed });
        }
        Ok(self.accept(passed, tool))
    }

    /// As [`SetPointGuard::pass`], for the set-points of a stop: the joints brake each by itself, so that the tool may for a
    /// moment be faster than on its path (in 5 of 4000 stops from random motions it was beyond a limit of 0.25 m/s, by 11 %
    /// at most), which is no reason not to brake. All limits of the joints are kept.
    ///
    /// # Errors
    /// Why nothing may be sent; the guard is then as it was before.
    pub fn pass_stop(&mut self, wanted: &[f64; N]) -> Result<[f64; N], GuardFault> {
        let passed = self.pass_joints(wanted)?;
        let tool = self.tool_at(&passed);
        Ok(self.accept(passed, tool))
    }

    /// Where the arm was sent, and how fast it moves at that time: of the parabola of acceleration through the last
    /// set-points.
    pub fn states(&self) -> [State; N] {
        let period = self.period;
        std::array::from_fn(|index| {
            let Passed {
                position,
                velocity,
                acceleration,
                jerk,
                ..
            } = self.joints[index];
            let most = self.limits.joints[index].acceleration;
            let now = (acceleration + jerk * period).clamp(-most, most);
            State {
                position,
                velocity: velocity + period * (now / 2.0 - period * jerk / 6.0),
                acceleration: now,
            }
        })
    }

    fn pass_joints(&self, wanted: &[f64; N]) -> Result<[Passed; N], GuardFault> {
        let mut passed = self.joints;
        for (index, (joint, wanted)) in passed.iter_mut().zip(wanted).enumerate() {
            *joint = self.pass_joint(index, *wanted)?;
        }
        Ok(passed)
    }

    fn accept(&mut self, passed: [Passed; N], tool: Vector3<f64>) -> [f64; N] {
        (self.joints, self.tool) = (passed, tool);
        passed.map(|joint| joint.position)
    }

    fn tool_at(&self, joints: &[Passed; N]) -> Vector3<f64> {
        let pose = self.chain.forward(&SVector::from(joints.map(|joint| joint.position)));
        // The positions are finite: they were checked.
        pose.map_or(self.tool, |pose| pose.translation())
    }

    fn pass_joint(&self, index: usize, wanted: f64) -> Result<Passed, GuardFault> {
        let (joint, limits, before) = (index + 1, &self.limits.joints[index], &self.joints[index]);
        if !wanted.is_finite() {
            return Err(GuardFault::NotFinite { joint, value: wanted });
        }
        let slack = ROUNDING * (limits.upper - limits.lower);
        if !(limits.lower - slack..=limits.upper + slack).contains(&wanted) {
            return Err(GuardFault::Position {
                joint,
                value: wanted,
                least: limits.lower,
                most: limits.upper,
            });
        }
        let asked = before.moved(wanted, self.period);
        let returning = before.moved(wanted + before.returning(), self.period);
        let Some(nearest) = self.nearest(index, returning.acceleration) else {
            return Err(self.rate_fault(index, &asked, f64::INFINITY));
        };
        let mut passed = returning;
        if nearest.to_bits() != returning.acceleration.to_bits() {
            let position = before.position + self.period * (before.velocity + self.period * nearest);
            passed = before.moved(position.clamp(limits.lower, limits.upper), self.period);
        }
        let off = passed.position - wanted;
        if off.abs() > self.correction {
            return Err(self.rate_fault(index, &asked, off.abs()));
        }
        passed.off = [off, before.off[0], before.off[1]];
        Ok(passed)
    }

    /// The acceleration within all limits that is nearest to the one asked for; none when they leave nothing.
    fn nearest(&self, index: usize, asked: f64) -> Option<f64> {
        let (limits, before, period) = (&self.limits.joints[index], &self.joints[index], self.period);
        let jerk = (limits.jerk * (1.0 + ROUNDING) + NOISE) * period;
        let most = limits.acceleration * (1.0 + ROUNDING) + NOISE * period;
        let speed = limits.velocity * (1.0 + ROUNDING);
        let least = (before.acceleration - jerk)
            .max(-most)
            .max((-speed - before.velocity) / period);
        let most = (before.acceleration + jerk)
            .min(most)
            .min((speed - before.velocity) / period);
        (least <= most).then(|| asked.clamp(least, most))
    }

    fn rate_fault(&self, index: usize, asked: &Passed, off: f64) -> GuardFault {
        let limits = &self.limits.joints[index];
        let rates = [
            ("speed", asked.velocity, limits.velocity),
            ("acceleration", asked.acceleration, limits.acceleration),
            ("jerk", asked.jerk, limits.jerk),
        ];
        // A gross speed is a gross jerk as well; the first one exceeded says most.
        let worst = rates.into_iter().find(|(_, value, allowed)| value.abs() > *allowed);
        let (what, value, allowed) = worst.unwrap_or(rates[2]);
        GuardFault::Rate {
            joint: index + 1,
            what,
            value,
            allowed,
            off,
        }
    }
}

impl Passed {
    /// With the next set-point.
    fn moved(&self, position: f64, period: f64) -> Self {
        let velocity = (position - self.position) / period;
        let acceleration = (velocity - self.velocity) / period;
        Self {
            position,
            velocity,
            acceleration,
            jerk: (acceleration - self.acceleration) / period,
            off: self.off,
        }
    }

    /// How far from the set-point wanted next to be. Who is off and returns at once needs more and more jerk; here it
    /// dies out by the recurrence whose three roots are [`FADING`]. 0 for who is not off.
    fn returning(&self) -> f64 {
        let [first, second, third] = self.off;
        FADING * (3.0 * first - FADING * (3.0 * second - FADING * third))
    }
}
