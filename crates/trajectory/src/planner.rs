//! Plans for one arm with one tool.

use kinematics::Chain;
use nalgebra::SVector;

use crate::error::TrajectoryError;
use crate::limits::{ROUNDING, TrajectoryLimits};
use crate::motion::Motion;
use crate::quintic::State;
use crate::tool_speed::{Reach, ToolSpeed};
use crate::trajectory::Trajectory;

/// An arm, its tool and what they may do; makes trajectories that keep to it.
#[derive(Debug, Clone)]
pub struct Planner<const N: usize> {
    pub(crate) chain: Chain<N>,
    pub(crate) limits: TrajectoryLimits<N>,
    pub(crate) reach: Reach<N>,
}

/// Everything about a trajectory at one time, as a plot shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot<const N: usize> {
    /// Position, speed and acceleration of all joints.
    pub states: [State; N],
    /// Of all joints, rad/s³.
    pub jerk: [f64; N],
    /// Metres per second.
    pub tool_speed: f64,
}

impl<const N: usize> Planner<N> {
    /// The chain ends at the tool whose speed is limited and which follows lines.
    ///
    /// # Errors
    /// Limits that cannot be.
    pub fn new(chain: Chain<N>, limits: TrajectoryLimits<N>) -> Result<Self, TrajectoryError> {
        limits.check()?;
        let reach = Reach::of(&chain)?;
        Ok(Self { chain, limits, reach })
    }

    /// The arm, up to its tool.
    pub fn chain(&self) -> &Chain<N> {
        &self.chain
    }

    /// What it may do.
    pub fn limits(&self) -> &TrajectoryLimits<N> {
        &self.limits
    }

    /// The fastest minimum-jerk motion from rest to rest within the limits of the joints, slowed where the tool would
    /// be too fast.
    ///
    /// # Errors
    /// Numbers that are not finite, an end outside the limits.
    pub fn joint_motion(&self, from: &[f64; N], to: &[f64; N]) -> Result<Trajectory<N>, TrajectoryError> {
        let motion = Trajectory::from(Motion::rest_to_rest(from, to, &self.limits.joints)?);
        let excess = self.tool_speed(&motion)?.bound / self.limits.tool_speed;
        motion.slowed(excess.max(1.0))
    }

    /// The trajectory as fast as all limits allow, everything by the same factor; for trajectories from rest to rest.
    ///
    /// # Errors
    /// A begin or an end that moves: another speed would not be what was asked for there.
    pub fn retimed(&self, trajectory: &Trajectory<N>) -> Result<Trajectory<N>, TrajectoryError> {
        trajectory.require_rest()?;
        let tool = self.tool_speed(trajectory)?.bound / self.limits.tool_speed;
        let pace = trajectory.pace(&self.limits.joints).max(tool);
        // A trajectory that goes nowhere keeps its time.
        trajectory.slowed(if pace > 0.0 { pace } else { 1.0 })
    }

    /// Largest speed of the tool; see [`ToolSpeed`].
    pub fn tool_speed(&self, trajectory: &Trajectory<N>) -> Result<ToolSpeed, TrajectoryError> {
        ToolSpeed::along(&self.chain, &self.reach, trajectory)
    }

    /// Whether all limits hold at all times, the tool's as well, and nothing jumps; if not what does not. A tool speed is
    /// refused when it was found beyond the limit, not when only its bound is.
    pub fn check(&self, trajectory: &Trajectory<N>) -> Result<(), TrajectoryError> {
        trajectory.check(&self.limits.joints)?;
        let found = self.tool_speed(trajectory)?;
        let most = self.limits.tool_speed;
        if found.reached <= most * (1.0 + ROUNDING) {
            return Ok(());
        }
        Err(TrajectoryError::ToolSpeed {
            time: found.time,
            value: found.reached,
            most,
        })
    }

    /// Everything at a time.
    pub fn snapshot(&self, trajectory: &Trajectory<N>, time: f64) -> Result<Snapshot<N>, TrajectoryError> {
        let states = trajectory.sample(time);
        let angles = SVector::from(states.map(|state| state.position));
        let (_, jacobian) = self.chain.jacobian(&angles)?;
        let twist = jacobian * SVector::from(states.map(|state| state.velocity));
        Ok(Snapshot {
            states,
            jerk: trajectory.jerk(time),
            tool_speed: twist.fixed_rows::<3>(0).norm(),
        })
    }
}
