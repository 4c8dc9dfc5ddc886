//! How the loop runs.

use std::time::Duration;

use devices::JointValues;
use kinematics::Chain;
use trajectory::{JointLimits, SetPointGuard, TrajectoryError, TrajectoryLimits};

use super::PERIOD;

/// What the last gate allows more than motions are planned with.
const HEADROOM: f64 = 1.1;
/// Of the jerk of motions.
const STOP_JERK: f64 = 0.85;
/// What the last gate puts right, radians.
const CORRECTION: f64 = 1e-6;

/// How the loop runs.
#[derive(Debug, Clone)]
pub struct ServoConfig {
    /// The last gate; its limits are the arm's own.
    pub guard: SetPointGuard<7>,
    /// For stops; within those of the guard.
    pub stop_limits: [JointLimits; 7],
    /// A wake-up this late ends a motion.
    pub watchdog: Duration,
    /// Of `SCHED_FIFO`, 1 to 99; 0 to stay an ordinary thread.
    pub priority: u8,
}

impl ServoConfig {
    /// For an arm that rests at `start` (rad) and whose motions are planned within `limits`: the last gate has room for
    /// stops, which begin in states that are estimates at times and so take less than the full jerk. Watchdog 20 ms,
    /// priority 80.
    pub fn within(chain: Chain<7>, limits: &TrajectoryLimits<7>, start: &JointValues) -> Result<Self, TrajectoryError> {
        let mut gate = *limits;
        for joint in &mut gate.joints {
            joint.acceleration *= HEADROOM;
            joint.jerk *= HEADROOM;
        }
        Ok(Self {
            guard: SetPointGuard::new(chain, gate, PERIOD.as_secs_f64(), CORRECTION, start)?,
            stop_limits: limits.joints.map(|limits| JointLimits {
                jerk: STOP_JERK * limits.jerk,
                ..limits
            }),
            watchdog: Duration::from_millis(20),
            priority: 80,
        })
    }
}
