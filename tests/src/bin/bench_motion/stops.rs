//! Stops of random trajectories at random times, with the servo loop turned by hand.
//!
//! A stop is late when the first set-point after the request is not the first one of the fastest stop
//! ([`trajectory::Stop`]) from where the trajectory was, or when the arm is not held at rest after it.

use anyhow::Context;
use devices::JointValues;
use fastrand::Rng;
use nalgebra::{SVector, Vector3};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde::Serialize;
use trajectory::{Planner, State, Stop, Trajectory};
use trajectory_executor::servo::{PERIOD, ServoEvent, StopCause};

use crate::arm::{Arm, TOOL_SPEEDS};
use crate::stepped::Stepped;

/// How near blends pass waypoints, radians.
const TOLERANCE: f64 = 0.1;
/// Every so manieth trajectory is a blend.
const BLENDS: u64 = 4;
/// What the last gate may put right, and what differences of set-points lose by rounding, radians.
const SAME: f64 = 1e-9;
/// Of third differences over 4 ms, rad/s³.
const JERK_NOISE: f64 = 1e-3;
/// Periods after which a stop must have ended: 4 s.
const PATIENCE: usize = 1000;

#[derive(Debug, Default, Serialize)]
pub(crate) struct Outcomes {
    pub(crate) stops: u64,
    pub(crate) stop_late: u64,
    /// In which a joint is sent further in the first period than the trajectory would have, beyond rounding: only a joint
    /// that is about to turn round could be.
    pub(crate) stop_faster_joints: u64,
    /// With a joint whose set-points break a limit of speed, acceleration, jerk or position.
    pub(crate) stop_limit_breaks: u64,
    /// With a joint that cannot come to rest before its limit.
    pub(crate) stop_at_joint_limit: u64,
    /// Longest from request to rest.
    pub(crate) stop_max_ms: f64,
    /// In which the tool is faster than the motion's own limit for a moment: joints brake each by itself.
    pub(crate) stop_fast_tools: u64,
    /// Fastest of those tools, as a share of the limit.
    pub(crate) stop_tool_share: f64,
}

pub(crate) fn measure(arm: &Arm, count: u64) -> anyhow::Result<Outcomes> {
    let planners = [arm.planner(TOOL_SPEEDS[0])?, arm.planner(TOOL_SPEEDS[1])?];
    (0..count)
        .into_par_iter()
        .map(|number| stop(arm, &planners[(number % 2) as usize], number))
        .try_reduce(Outcomes::default, |one, other| Ok(one.with(&other)))
}

/// What the loop sent, from the set-point before the request on.
struct Sent {
    /// On the trajectory when the request came.
    states: [State; 7],
    /// One period later if it had not come.
    unbraked: JointValues,
    /// Three before the request, so that differences are there from the first one after it.
    set_points: Vec<JointValues>,
    ended: Option<ServoEvent>,
}

/// Index of the first set-point after the request.
const FIRST: usize = 3;

fn stop(arm: &Arm, planner: &Planner<7>, number: u64) -> anyhow::Result<Outcomes> {
    let mut random = Rng::with_seed(number);
    let trajectory = random_trajectory(arm, planner, &mut random, number)?;
    let sent = run(arm, &trajectory, &mut random)?;
    let start = trajectory.start().map(|state| state.position);
    let limits = arm.servo(&start)?.stop_limits;
    let expected = Stop::from(&sent.states, &limits)?;
    let is_at_limit = expected.overshoot(&limits).is_some();
    let first = expected.sample(PERIOD.as_secs_f64()).map(|state| state.position);
    let (before, after) = (&sent.set_points[FIRST - 1], &sent.set_points[FIRST]);
    let is_next = apart(after, &first) <= SAME;
    let faster = (0..7)
        .filter(|&joint| (after[joint] - before[joint]).abs() > (sent.unbraked[joint] - before[joint]).abs() + SAME);
    let share = tool_share(planner, &sent.set_points)?;
    Ok(Outcomes {
        stops: 1,
        stop_late: u64::from(!(is_next && sent.is_at_rest())),
        stop_faster_joints: u64::from(faster.count() > 0),
        stop_limit_breaks: u64::from(!keeps_limits(planner, &sent.set_points)),
        stop_at_joint_limit: u64::from(is_at_limit),
        stop_max_ms: 1e3 * expected.duration(),
        stop_fast_tools: u64::from(share > 1.0 + SAME),
        stop_tool_share: share,
    })
}

fn random_trajectory(arm: &Arm, planner: &Planner<7>, random: &mut Rng, number: u64) -> anyhow::Result<Trajectory<7>> {
    let (from, to) = (arm.anywhere(random), arm.anywhere(random));
    if number.is_multiple_of(BLENDS) {
        return Ok(planner.through(&[from, arm.anywhere(random), to], TOLERANCE)?);
    }
    Ok(planner.joint_motion(&from, &to)?)
}

/// Asks for the stop after a random set-point, neither among the first nor the last three.
fn run(arm: &Arm, trajectory: &Trajectory<7>, random: &mut Rng) -> anyhow::Result<Sent> {
    let period = PERIOD.as_secs_f64();
    let start = trajectory.start().map(|state| state.position);
    let steps = (trajectory.duration() / period) as usize;
    let asked_after = random.usize(FIRST..steps.saturating_sub(3).max(FIRST + 1));
    let mut stepped = Stepped::holding(arm.servo(&start)?, start, asked_after + PATIENCE + 10)?;
    stepped.follow(trajectory.clone())?;
    let mut time = 0.0;
    for _ in 0..asked_after {
        stepped.turn();
        time += period;
    }
    stepped.remote().stop();
    let mut ended = None;
    for _ in 0..PATIENCE {
        stepped.turn();
        ended = stepped.take_event();
        if ended.is_some() {
            break;
        }
    }
    (0..3).for_each(|_| stepped.turn());
    // The first one held the arm before the trajectory began.
    let set_points = stepped.sent().split_off(1 + asked_after - FIRST);
    Ok(Sent {
        states: trajectory.sample(time),
        unbraked: trajectory.sample(time + period).map(|state| state.position),
        set_points,
        ended,
    })
}

impl Sent {
    /// Stopped by the request, and held since: the last set-points are the same.
    fn is_at_rest(&self) -> bool {
        let by_request = matches!(
            self.ended,
            Some(ServoEvent::Stopped {
                cause: StopCause::Requested,
                ..
            })
        );
        let mut last = self.set_points.iter().rev();
        let held = last.next();
        by_request && last.take(3).all(|set_point| Some(set_point) == held)
    }
}

impl Outcomes {
    fn with(self, other: &Self) -> Self {
        Self {
            stops: self.stops + other.stops,
            stop_late: self.stop_late + other.stop_late,
            stop_faster_joints: self.stop_faster_joints + other.stop_faster_joints,
            stop_limit_breaks: self.stop_limit_breaks + other.stop_limit_breaks,
            stop_at_joint_limit: self.stop_at_joint_limit + other.stop_at_joint_limit,
            stop_max_ms: self.stop_max_ms.max(other.stop_max_ms),
            stop_fast_tools: self.stop_fast_tools + other.stop_fast_tools,
            stop_tool_share: self.stop_tool_share.max(other.stop_tool_share),
        }
    }
}

/// By differences of the set-points: what the arm's controller sees.
fn keeps_limits(planner: &Planner<7>, set_points: &[JointValues]) -> bool {
    let period = PERIOD.as_secs_f64();
    set_points.windows(4).all(|window| {
        planner.limits().joints.iter().enumerate().all(|(joint, limits)| {
            let [d, c, b, a] = [0, 1, 2, 3].map(|index| window[index][joint]);
            let speed = (a - b) / period;
            let acceleration = (a - 2.0 * b + c) / period.powi(2);
            let jerk = (a - 3.0 * b + 3.0 * c - d) / period.powi(3);
            (limits.lower - SAME..=limits.upper + SAME).contains(&a)
                && speed.abs() <= limits.velocity * (1.0 + 1e-6)
                && acceleration.abs() <= limits.acceleration * (1.0 + 1e-6)
                && jerk.abs() <= limits.jerk * (1.0 + 1e-6) + JERK_NOISE
        })
    })
}

/// Fastest mean speed of the tool over a period after the request, as a share of the limit of motions.
fn tool_share(planner: &Planner<7>, set_points: &[JointValues]) -> anyhow::Result<f64> {
    let place = |angles: &JointValues| planner.chain().forward(&SVector::from(*angles));
    let tools = set_points[FIRST - 1..]
        .iter()
        .map(|angles| Ok(place(angles)?.translation()));
    let tools: Vec<Vector3<f64>> = tools.collect::<anyhow::Result<_>>()?;
    let speeds = tools
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).norm() / PERIOD.as_secs_f64());
    let fastest = speeds.reduce(f64::max).context("a stop has set-points")?;
    Ok(fastest / planner.limits().tool_speed)
}

fn apart(one: &JointValues, other: &JointValues) -> f64 {
    let differences = one.iter().zip(other).map(|(one, other)| (one - other).abs());
    differences.fold(0.0, f64::max)
}
