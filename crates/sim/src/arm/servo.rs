//! Mode 1: the arm goes to the last set-point at full speed.

use std::time::Instant;

use super::STEP;
use super::model::Joints;
use super::planner::fault;

/// Largest speed of a joint, rad/s.
pub(super) const JOINT_SPEED: f64 = std::f64::consts::PI;
/// Largest speed of the tool, m/s.
const TOOL_SPEED: f64 = 1.0;
/// Largest distance of the tool between successive set-points, metres.
const LARGEST_STEP: f64 = 0.010;
/// Numbers on the wire are single precision.
const ROUNDING: f64 = 1e-4;

#[derive(Debug, Clone, Copy)]
pub(super) struct Servo {
    pub(super) target: Joints,
    last: Option<Instant>,
}

impl Servo {
    pub(super) fn at(joints: &Joints) -> Self {
        Self {
            target: *joints,
            last: None,
        }
    }

    /// The next set-point; `tool_step` is how far the tool goes with it, metres. Refused with the number of an error
    /// when joints or tool would have to be faster than they can in the time since the set-point before, at least one
    /// period.
    pub(super) fn aim(&mut self, target: &Joints, tool_step: f64, at: Instant) -> Result<(), u8> {
        let elapsed = self
            .last
            .map_or(0.0, |last| at.saturating_duration_since(last).as_secs_f64());
        let elapsed = elapsed.max(STEP) * (1.0 + ROUNDING);
        let longest = (0..7)
            .map(|joint| (target[joint] - self.target[joint]).abs())
            .fold(0.0, f64::max);
        if longest > JOINT_SPEED * elapsed {
            return Err(fault::JOINT_SPEED);
        }
        if tool_step > TOOL_SPEED * elapsed || tool_step > LARGEST_STEP {
            return Err(fault::TOOL_SPEED);
        }
        (self.target, self.last) = (*target, Some(at));
        Ok(())
    }

    /// Where the joints are a step later.
    pub(super) fn step(&self, joints: &Joints) -> Joints {
        let most = JOINT_SPEED * STEP;
        std::array::from_fn(|joint| joints[joint] + (self.target[joint] - joints[joint]).clamp(-most, most))
    }
}
