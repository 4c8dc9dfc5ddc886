//! Random trajectories, and whether they break a limit anywhere.
//!
//! Of a thousand, 980 are joint motions from rest to rest, 15 go past a waypoint without stopping, 5 are straight lines of
//! the tool; half of each with the tool at up to 0.25 m/s, half at up to 0.95 m/s. Positions, speeds, accelerations and
//! jerks are checked by the exact extremes of every polynomial, the tool's speed by a search with a bound between samples.
//! All lines and one in a hundred of the others are looked at from outside as well, by their samples alone.

use std::time::Instant;

use devices::JointValues;
use fastrand::Rng;
use geometry::RigidTransform;
use nalgebra::{SVector, Vector3};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use scenarios::quantile;
use serde::Serialize;
use trajectory::{Planner, State, Trajectory, TrajectoryError};

use crate::arm::{Arm, HOME, TOOL_SPEEDS};

/// Of a thousand.
const BLENDS: u64 = 15;
const LINES: u64 = 5;
/// How near blends pass waypoints, radians.
const TOLERANCE: f64 = 0.1;
/// One of so many motions and blends is sampled, and every line.
const SAMPLED: u64 = 100;
/// Between samples, seconds.
const STEP: f64 = 1e-3;
/// Ends are met to this, radians; speeds and accelerations are 0 there to the other two.
const AT_REST: [f64; 3] = [1e-9, 1e-9, 1e-6];
/// The ends of lines are solutions of inverse kinematics: metres.
const LINE_END: f64 = 1e-6;
const ROUNDING: f64 = 1e-9;

#[derive(Debug, Serialize)]
pub(crate) struct Trajectories {
    pub(crate) traj_checked: u64,
    pub(crate) traj_violations: u64,
    /// Of those checked, looked at from outside as well.
    pub(crate) traj_sampled: u64,
    pub(crate) traj_blends: u64,
    pub(crate) traj_lines: u64,
    /// Lines that leave the arm's reach or its limits: the planner says so, there is nothing to check.
    pub(crate) lines_refused: u64,
    /// Fastest tool found, as a share of its limit.
    pub(crate) tool_speed_share: f64,
    /// Medians of planning.
    pub(crate) plan_us: f64,
    pub(crate) plan_blend_us: f64,
    pub(crate) plan_line_us: f64,
    /// Planning and checking all of them.
    pub(crate) traj_seconds: f64,
    pub(crate) threads: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Motion,
    Blend,
    Line,
}

/// Sums over cases.
#[derive(Default)]
struct Tally {
    checked: [u64; 3],
    violations: u64,
    sampled: u64,
    refused: u64,
    tool_speed_share: f64,
    /// Microseconds.
    times: [Vec<f64>; 3],
}

/// What was to be planned, and what came of it.
struct Case {
    kind: Kind,
    from: JointValues,
    to: Goal,
    planned: Result<Trajectory<7>, TrajectoryError>,
    micros: f64,
}

enum Goal {
    Angles(JointValues),
    Pose(RigidTransform),
}

pub(crate) fn measure(arm: &Arm, count: u64) -> anyhow::Result<Trajectories> {
    let planners = [arm.planner(TOOL_SPEEDS[0])?, arm.planner(TOOL_SPEEDS[1])?];
    let started = Instant::now();
    let tally = (0..count)
        .into_par_iter()
        .fold(Tally::default, |mut tally, number| {
            let mut random = Rng::with_seed(number);
            let planner = &planners[random.usize(0..planners.len())];
            let case = Case::random(arm, planner, &mut random, number);
            tally.add(planner, &case, random.u64(0..SAMPLED) == 0);
            tally
        })
        .reduce(Tally::default, Tally::with);
    let seconds = started.elapsed().as_secs_f64();
    let [motion, blend, line] = tally.times.map(|times| quantile(&times, 0.5).unwrap_or(f64::NAN));
    Ok(Trajectories {
        traj_checked: tally.checked.iter().sum(),
        traj_violations: tally.violations,
        traj_sampled: tally.sampled,
        traj_blends: tally.checked[Kind::Blend as usize],
        traj_lines: tally.checked[Kind::Line as usize],
        lines_refused: tally.refused,
        tool_speed_share: tally.tool_speed_share,
        plan_us: motion,
        plan_blend_us: blend,
        plan_line_us: line,
        traj_seconds: seconds,
        threads: rayon::current_num_threads(),
    })
}

impl Kind {
    fn of(number: u64) -> Self {
        match number % 1000 {
            0..BLENDS => Self::Blend,
            place if place < BLENDS + LINES => Self::Line,
            _ => Self::Motion,
        }
    }
}

impl Case {
    fn random(arm: &Arm, planner: &Planner<7>, random: &mut Rng, number: u64) -> Self {
        let kind = Kind::of(number);
        let (from, to) = (arm.anywhere(random), arm.anywhere(random));
        match kind {
            Kind::Motion => Self::planned(kind, from, Goal::Angles(to), || planner.joint_motion(&from, &to)),
            Kind::Blend => {
                let waypoints = [from, arm.anywhere(random), to];
                Self::planned(kind, from, Goal::Angles(to), || planner.through(&waypoints, TOLERANCE))
            }
            Kind::Line => {
                let (from, pose) = line_ends(arm, random);
                Self::planned(kind, from, Goal::Pose(pose), || {
                    Ok(planner.line(&from, &pose)?.trajectory)
                })
            }
        }
    }

    fn planned(
        kind: Kind,
        from: JointValues,
        to: Goal,
        plan: impl FnOnce() -> Result<Trajectory<7>, TrajectoryError>,
    ) -> Self {
        let started = Instant::now();
        let planned = plan();
        let micros = 1e6 * started.elapsed().as_secs_f64();
        Self {
            kind,
            from,
            to,
            planned,
            micros,
        }
    }
}

/// 200 mm in a random direction, beginning near home.
fn line_ends(arm: &Arm, random: &mut Rng) -> (JointValues, RigidTransform) {
    let from = HOME.map(|angle| angle + 0.4 * (random.f64() - 0.5));
    let start = arm.chain.forward(&SVector::from(from)).expect("the angles are finite");
    let way = Vector3::from_fn(|_, _| random.f64() - 0.5).normalize() * 0.2;
    (
        from,
        RigidTransform::from_parts(start.translation() + way, start.rotation()),
    )
}

impl Tally {
    fn add(&mut self, planner: &Planner<7>, case: &Case, is_drawn: bool) {
        self.times[case.kind as usize].push(case.micros);
        let Ok(trajectory) = &case.planned else {
            if case.kind == Kind::Line {
                self.refused += 1;
            } else {
                self.violations += 1;
            }
            return;
        };
        self.checked[case.kind as usize] += 1;
        let mut is_good = trajectory.check(&planner.limits().joints).is_ok() && meets_ends(planner, case, trajectory);
        match planner.tool_speed(trajectory) {
            Ok(found) => {
                let share = found.reached / planner.limits().tool_speed;
                self.tool_speed_share = self.tool_speed_share.max(share);
                is_good &= share <= 1.0 + ROUNDING;
            }
            Err(_) => is_good = false,
        }
        if is_drawn || case.kind == Kind::Line {
            self.sampled += 1;
            is_good &= keeps_limits_from_outside(planner, trajectory);
        }
        self.violations += u64::from(!is_good);
    }

    fn with(mut self, other: Self) -> Self {
        for (ours, theirs) in self.checked.iter_mut().zip(other.checked) {
            *ours += theirs;
        }
        for (ours, theirs) in self.times.iter_mut().zip(other.times) {
            ours.extend(theirs);
        }
        Self {
            violations: self.violations + other.violations,
            sampled: self.sampled + other.sampled,
            refused: self.refused + other.refused,
            tool_speed_share: self.tool_speed_share.max(other.tool_speed_share),
            ..self
        }
    }
}

fn meets_ends(planner: &Planner<7>, case: &Case, trajectory: &Trajectory<7>) -> bool {
    let rests_at = |states: [State; 7], wanted: &JointValues| {
        states.iter().zip(wanted).all(|(state, wanted)| {
            let off = [state.position - wanted, state.velocity, state.acceleration];
            off.iter().zip(AT_REST).all(|(off, most)| off.abs() <= most)
        })
    };
    let end = trajectory.end();
    let angles = end.map(|state| state.position);
    let is_there = match &case.to {
        Goal::Angles(wanted) => rests_at(end, wanted),
        Goal::Pose(pose) => {
            let reached = planner.chain().forward(&SVector::from(angles));
            let is_near = reached.is_ok_and(|reached| (reached.translation() - pose.translation()).norm() <= LINE_END);
            is_near && rests_at(end, &angles)
        }
    };
    is_there && rests_at(trajectory.start(), &case.from)
}

/// What somebody sees who is only shown the positions, speeds and accelerations at some times.
fn keeps_limits_from_outside(planner: &Planner<7>, trajectory: &Trajectory<7>) -> bool {
    let place = |states: &[State; 7]| {
        let angles = SVector::from(states.map(|state| state.position));
        planner.chain().forward(&angles).map(|pose| pose.translation())
    };
    let limits = planner.limits();
    let mut before = trajectory.start();
    let Ok(mut tool_before) = place(&before) else {
        return false;
    };
    for index in 1..=(trajectory.duration() / STEP).ceil() as usize + 1 {
        let now = trajectory.sample(index as f64 * STEP);
        let Ok(tool) = place(&now) else { return false };
        let is_slow = (tool - tool_before).norm() <= limits.tool_speed * STEP * (1.0 + ROUNDING) + ROUNDING * STEP;
        let joints = now.iter().zip(&before).zip(&limits.joints);
        let is_within = joints.into_iter().all(|((now, before), limits)| {
            let changes = [
                (now.position - before.position, limits.velocity),
                (now.velocity - before.velocity, limits.acceleration),
                (now.acceleration - before.acceleration, limits.jerk),
            ];
            let slack = ROUNDING * (limits.upper - limits.lower);
            (limits.lower - slack..=limits.upper + slack).contains(&now.position)
                && now.velocity.abs() <= limits.velocity * (1.0 + ROUNDING)
                && now.acceleration.abs() <= limits.acceleration * (1.0 + ROUNDING)
                // Differences of accelerations near 10 rad/s² are exact to 1e-14.
                && changes.iter().all(|(change, most)| change.abs() <= most * STEP * (1.0 + ROUNDING) + 1e-12)
        });
        if !(is_slow && is_within) {
            return false;
        }
        (before, tool_before) = (now, tool);
    }
    true
}
