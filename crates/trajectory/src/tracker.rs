//! Joint angles along a path of the tool.
//!
//! Resolved rates (Whitney, "Resolved motion rate control of manipulators and human prostheses", IEEE T-MMS 10(2), 1969):
//! `q̇ = J⁺ v + (I - J⁺ J) z`, the least joint speeds for the tool's, and with what they leave free away from the joints'
//! limits. It is integrated (Runge and Kutta's method of fourth order) and after each step put right by Newton's method,
//! so that errors do not add up. The angles depend smoothly on the way and cannot jump to another branch: where the
//! tool could only go on with a jump, they do not follow.

use kinematics::{Chain, Jacobian};
use nalgebra::{SMatrix, SVector, Vector6};

use crate::error::TrajectoryError;
use crate::limits::TrajectoryLimits;
use crate::quintic::State;
use crate::tool_path::{ToolMotion, ToolPath, pose_error, sizes};

/// Damping of the pseudoinverse, so that it exists at a singularity.
const DAMPING: f64 = 1e-9;
/// Poses are met to this, metres and radians.
const PRECISION: f64 = 1e-9;
/// Newton steps; two are needed.
const MOST_CORRECTIONS: usize = 12;
/// Longest way of a joint in one step, radians.
const LONGEST_STEP: f64 = 0.25;
/// Halvings of a step before it is given up.
const MOST_HALVINGS: usize = 4;
/// Power of the share of the half range with which the push grows.
const PUSH_POWER: i32 = 7;
/// Change of the angles over which derivatives are taken, radians.
const PROBE: f64 = 1e-4;

type Angles<const N: usize> = SVector<f64, N>;

/// Follows a path.
pub(crate) struct Tracker<'a, const N: usize> {
    pub(crate) chain: &'a Chain<N>,
    pub(crate) limits: &'a TrajectoryLimits<N>,
    pub(crate) path: &'a ToolPath<'a>,
    /// Away from limits, radians per metre of the tool's way: nothing in the middle, this at the end of the range.
    pub(crate) push: f64,
}

/// Why a step was not taken.
enum Refused<const N: usize> {
    /// Metres and radians that are left.
    Away([f64; 2]),
    /// Joint's index and way.
    Swing(usize, f64),
}

impl<const N: usize> Tracker<'_, N> {
    /// Angles at `to`, from those at `from`; in smaller steps where a large one fails.
    pub(crate) fn advance(&self, angles: &Angles<N>, from: f64, to: f64) -> Result<Angles<N>, TrajectoryError> {
        let found = self.advance_by_halves(angles, from, to, 0)?;
        self.require_limits(&found, to)?;
        Ok(found)
    }

    fn advance_by_halves(
        &self,
        angles: &Angles<N>,
        from: f64,
        to: f64,
        halvings: usize,
    ) -> Result<Angles<N>, TrajectoryError> {
        match self.step(angles, from, to)? {
            Ok(found) => Ok(found),
            Err(refused) if halvings == MOST_HALVINGS => Err(self.error(&refused, from)),
            Err(_) => {
                let middle = f64::midpoint(from, to);
                let angles = self.advance_by_halves(angles, from, middle, halvings + 1)?;
                self.require_limits(&angles, middle)?;
                self.advance_by_halves(&angles, middle, to, halvings + 1)
            }
        }
    }

    fn step(&self, angles: &Angles<N>, from: f64, to: f64) -> Result<Result<Angles<N>, Refused<N>>, TrajectoryError> {
        let (step, middle) = (to - from, f64::midpoint(from, to));
        let rate = |angles: &Angles<N>, time: f64| self.rate(angles, &self.path.at(time).motion);
        let first = rate(angles, from)?;
        let second = rate(&(angles + first * (step / 2.0)), middle)?;
        let third = rate(&(angles + second * (step / 2.0)), middle)?;
        let fourth = rate(&(angles + third * step), to)?;
        let way = (first + (second + third) * 2.0 + fourth) * (step / 6.0);
        if let Some(refused) = swing(&way) {
            return Ok(Err(refused));
        }
        let found = match self.corrected(angles + way, to)? {
            Ok(found) => found,
            Err(away) => return Ok(Err(Refused::Away(away))),
        };
        Ok(swing(&(found - angles)).map_or(Ok(found), Err))
    }

    /// The nearest angles that meet the pose at a time, or what they miss it by.
    fn corrected(&self, mut angles: Angles<N>, time: f64) -> Result<Result<Angles<N>, [f64; 2]>, TrajectoryError> {
        let wanted = self.path.at(time).pose;
        let mut left = [f64::INFINITY; 2];
        for _ in 0..MOST_CORRECTIONS {
            let (pose, jacobian) = self.chain.jacobian(&angles)?;
            let error = pose_error(&pose, &wanted);
            left = sizes(&error);
            if left[0].max(left[1]) <= PRECISION {
                return Ok(Ok(angles));
            }
            let correction = inverse_times(&jacobian, &error);
            angles += correction * (LONGEST_STEP / correction.amax().max(LONGEST_STEP));
        }
        Ok(Err(left))
    }

    /// Joint speeds for a motion of the tool; linear in it.
    fn rate(&self, angles: &Angles<N>, motion: &ToolMotion) -> Result<Angles<N>, TrajectoryError> {
        let (_, jacobian) = self.chain.jacobian(angles)?;
        let push = Angles::<N>::from_fn(|joint, _| {
            let limits = &self.limits.joints[joint];
            let (middle, half) = (
                f64::midpoint(limits.lower, limits.upper),
                (limits.upper - limits.lower) / 2.0,
            );
            -self.push * motion.progress * ((angles[joint] - middle) / half).powi(PUSH_POWER)
        });
        // J⁺ v + (I - J⁺ J) z = z + J⁺ (v - J z)
        Ok(push + inverse_times(&jacobian, &(motion.twist - jacobian * push)))
    }

    /// Position, speed and acceleration of all joints at a time.
    pub(crate) fn states(&self, angles: &Angles<N>, time: f64) -> Result<[State; N], TrajectoryError> {
        let tool = self.path.at(time);
        let speeds = self.rate(angles, &tool.motion)?;
        let mut accelerations = self.rate(angles, &tool.change)?;
        let fastest = speeds.amax();
        if fastest > 0.0 {
            let ahead = PROBE / fastest;
            let after = self.rate(&(angles + speeds * ahead), &tool.motion)?;
            let before = self.rate(&(angles - speeds * ahead), &tool.motion)?;
            accelerations += (after - before) / (2.0 * ahead);
        }
        Ok(std::array::from_fn(|joint| State {
            position: angles[joint],
            velocity: speeds[joint],
            acceleration: accelerations[joint],
        }))
    }

    fn require_limits(&self, angles: &Angles<N>, time: f64) -> Result<(), TrajectoryError> {
        let mut pairs = angles.iter().zip(&self.limits.joints);
        let outside = pairs.position(|(angle, limits)| !(limits.lower..=limits.upper).contains(angle));
        let Some(index) = outside else { return Ok(()) };
        let (line, percent, millimetres) = self.path.place(time);
        Err(TrajectoryError::LimitOnLine {
            line,
            joint: index + 1,
            percent,
            millimetres,
            value: angles[index],
            least: self.limits.joints[index].lower,
            most: self.limits.joints[index].upper,
        })
    }

    fn error(&self, refused: &Refused<N>, time: f64) -> TrajectoryError {
        let (line, percent, millimetres) = self.path.place(time);
        match *refused {
            Refused::Away([metres, radians]) => TrajectoryError::Unreachable {
                line,
                percent,
                millimetres,
                off_mm: 1e3 * metres,
                off_mrad: 1e3 * radians,
            },
            Refused::Swing(index, swing) => TrajectoryError::Swing {
                line,
                joint: index + 1,
                percent,
                millimetres,
                swing,
            },
        }
    }
}

fn swing<const N: usize>(way: &Angles<N>) -> Option<Refused<N>> {
    let joint = way.icamax();
    let is_small = way[joint].abs() <= LONGEST_STEP;
    (!is_small).then_some(Refused::Swing(joint, way[joint]))
}

/// `Jᵀ (J Jᵀ + λ)⁻¹ e`.
fn inverse_times<const N: usize>(jacobian: &Jacobian<N>, error: &Vector6<f64>) -> Angles<N> {
    let square = jacobian * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * DAMPING;
    // Positive definite for all finite Jacobians; what is not finite stays put and is then found to be away.
    square
        .cholesky()
        .map_or_else(Angles::<N>::zeros, |square| jacobian.transpose() * square.solve(error))
}
