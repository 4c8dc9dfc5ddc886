//! Straight lines of the tool.

use geometry::RigidTransform;
use nalgebra::SVector;

use crate::blend::require_tolerance;
use crate::error::TrajectoryError;
use crate::motion::SHORTEST;
use crate::planner::Planner;
use crate::schedule::{Leg, events, overlap, schedule};
use crate::segment::Segment;
use crate::tool_path::{ToolLine, ToolPath, pose_error, sizes};
use crate::tracker::Tracker;
use crate::trajectory::Trajectory;

/// Most that the tool may be off its line: metres, radians.
const MOST_OFF: [f64; 2] = [2e-4, 1e-3];
/// Way of the tool between two joint positions that are computed, to begin with, metres.
const SPACING: f64 = 0.02;
/// Least pieces from one event to the next.
const LEAST_PIECES: usize = 3;
/// How often the spacing is halved when the path is off too far.
const MOST_HALVINGS: usize = 4;
/// Places between two computed ones at which the tool is compared with the line.
const PROBES: usize = 6;
/// Pushes away from joint limits, radians per metre: the next one when a limit is reached in spite of the one before.
const PUSHES: [f64; 3] = [6.0, 30.0, 120.0];
/// Lines shorter than this are none, metres.
const NOWHERE: f64 = 1e-9;

/// A trajectory whose tool follows lines.
#[derive(Debug, Clone, PartialEq)]
pub struct LinePlan<const N: usize> {
    /// Of the joints.
    pub trajectory: Trajectory<N>,
    /// Largest distance of the tool from where it should be at that time, hence from its line, metres; at most 0.2 mm.
    pub position_error: f64,
    /// Largest angle from the orientation it should have, radians; at most 1 mrad.
    pub rotation_error: f64,
}

/// How far a tool is off its path: metres, radians.
#[derive(Debug, Clone, Copy, Default)]
struct PathError {
    /// Largest of each.
    most: [f64; 2],
    /// Where it is worst.
    worst: [f64; 2],
    /// When.
    time: f64,
}

impl<const N: usize> Planner<N> {
    /// The tool goes on a straight line from where it is at the angles `from` to the pose `base_from_tool`, from rest to
    /// rest by minimum jerk, its orientation on the shortest arc by the same law; as fast as all limits allow.
    ///
    /// # Errors
    /// Numbers that are not finite, a start outside the limits; how far the arm comes on the line, and why not further.
    pub fn line(&self, from: &[f64; N], base_from_tool: &RigidTransform) -> Result<LinePlan<N>, TrajectoryError> {
        self.lines(from, std::slice::from_ref(base_from_tool), 0.0)
    }

    /// Lines through poses, past all but the last of them within `tolerance` (metres) without stopping; with 0 it stops
    /// at every pose. Turns count as ways of a tool of 100 mm. Poses that repeat the one before are skipped.
    ///
    /// # Errors
    /// As for one line, with the number of the pose it leads to, and no poses or a tolerance that is negative.
    pub fn lines(
        &self,
        from: &[f64; N],
        poses: &[RigidTransform],
        tolerance: f64,
    ) -> Result<LinePlan<N>, TrajectoryError> {
        require_tolerance("blend tolerance", tolerance)?;
        if poses.is_empty() {
            return Err(TrajectoryError::Empty { what: "poses" });
        }
        for (index, (limits, angle)) in self.limits.joints.iter().zip(from).enumerate() {
            limits.require_within(index + 1, "start", *angle)?;
        }
        let start = SVector::from(*from);
        let first = self.chain.forward(&start)?;
        let lines = lines_between(&first, poses)?;
        if lines.is_empty() {
            let trajectory = Trajectory::hold(from, SHORTEST)?;
            return Ok(LinePlan::exact(trajectory));
        }
        let stopping = self.stopping(&start, &first, &lines)?;
        if lines.len() == 1 || tolerance == 0.0 {
            return LinePlan::joined(stopping);
        }
        self.blended(&start, &first, &lines, &stopping, tolerance)
    }

    /// Each line by itself, one after the other.
    fn stopping(
        &self,
        start: &SVector<f64, N>,
        first: &RigidTransform,
        lines: &[ToolLine],
    ) -> Result<Vec<LinePlan<N>>, TrajectoryError> {
        let (mut angles, mut pose) = (*start, *first);
        let mut plans = Vec::with_capacity(lines.len());
        for line in lines {
            // Any duration: the plan is brought to the fastest one.
            let duration = (2.0 * line.length() / self.limits.tool_speed).max(SHORTEST);
            let path = ToolPath {
                start: pose,
                lines: std::slice::from_ref(line),
                legs: schedule(&[duration], &[]),
            };
            let plan = self.fitted(&angles, &path)?;
            angles = SVector::from(plan.trajectory.end().map(|state| state.position));
            pose = path.at(duration).pose;
            plans.push(plan);
        }
        Ok(plans)
    }

    /// The lines overlap where they meet, unless that takes longer.
    fn blended(
        &self,
        start: &SVector<f64, N>,
        first: &RigidTransform,
        lines: &[ToolLine],
        stopping: &[LinePlan<N>],
        tolerance: f64,
    ) -> Result<LinePlan<N>, TrajectoryError> {
        let durations: Vec<f64> = stopping.iter().map(|plan| plan.trajectory.duration()).collect();
        let corners = lines.windows(2).zip(durations.windows(2));
        let overlaps = corners.map(|(lines, durations)| {
            let [one, other] = [lines[0].way(), lines[1].way()];
            overlap(&one, &other, [durations[0], durations[1]], tolerance)
        });
        let path = ToolPath {
            start: *first,
            lines,
            legs: schedule(&durations, &overlaps.collect::<Vec<_>>()),
        };
        let plan = self.fitted(start, &path)?;
        if plan.trajectory.duration() < durations.iter().sum() {
            return Ok(plan);
        }
        LinePlan::joined(stopping.to_vec())
    }

    /// With the gentlest push away from joint limits that keeps them; the error is that of the gentlest one.
    fn fitted(&self, start: &SVector<f64, N>, path: &ToolPath) -> Result<LinePlan<N>, TrajectoryError> {
        let gentle = self.pushed(start, path, PUSHES[0]);
        if !matches!(gentle, Err(TrajectoryError::LimitOnLine { .. })) {
            return gentle;
        }
        let mut harder = PUSHES[1..].iter().map(|push| self.pushed(start, path, *push));
        harder.find(Result::is_ok).unwrap_or(gentle)
    }

    /// Joint angles along a path, at narrower places until the tool is near enough to it everywhere, then as fast as
    /// limits allow.
    fn pushed(&self, start: &SVector<f64, N>, path: &ToolPath, push: f64) -> Result<LinePlan<N>, TrajectoryError> {
        let mut spacing = SPACING;
        let mut off = PathError::default();
        for _ in 0..=MOST_HALVINGS {
            let trajectory = self.tracked(start, path, spacing, push)?;
            off = self.path_error(&trajectory, path)?;
            if off.share() <= 1.0 {
                let trajectory = self.retimed(&trajectory)?;
                trajectory.check(&self.limits.joints)?;
                return Ok(LinePlan {
                    trajectory,
                    position_error: off.most[0],
                    rotation_error: off.most[1],
                });
            }
            spacing /= 2.0;
        }
        let (line, percent, millimetres) = path.place(off.time);
        Err(TrajectoryError::OffLine {
            line,
            percent,
            millimetres,
            off_mm: 1e3 * off.worst[0],
            off_mrad: 1e3 * off.worst[1],
            most_mm: 1e3 * MOST_OFF[0],
            most_mrad: 1e3 * MOST_OFF[1],
        })
    }

    fn tracked(
        &self,
        start: &SVector<f64, N>,
        path: &ToolPath,
        spacing: f64,
        push: f64,
    ) -> Result<Trajectory<N>, TrajectoryError> {
        let tracker = Tracker {
            chain: &self.chain,
            limits: &self.limits,
            path,
            push,
        };
        let (mut angles, mut before) = (*start, tracker.states(start, 0.0)?);
        let mut segments = Vec::new();
        for pair in times(path, spacing).windows(2) {
            angles = tracker.advance(&angles, pair[0], pair[1])?;
            let after = tracker.states(&angles, pair[1])?;
            segments.push(Segment::between(&before, &after, pair[1] - pair[0])?);
            before = after;
        }
        Ok(Trajectory::joined(segments))
    }

    /// Between the tool and its path, with the path's timing.
    fn path_error(&self, trajectory: &Trajectory<N>, path: &ToolPath) -> Result<PathError, TrajectoryError> {
        let mut found = PathError::default();
        for (begin, segment) in trajectory.placed() {
            for probe in 1..=PROBES {
                let time = segment.duration() * probe as f64 / (PROBES + 1) as f64;
                let angles = segment.sample(time).map(|state| state.position);
                let pose = self.chain.forward(&SVector::from(angles))?;
                found.add(begin + time, sizes(&pose_error(&pose, &path.at(begin + time).pose)));
            }
        }
        Ok(found)
    }
}

impl PathError {
    fn add(&mut self, time: f64, off: [f64; 2]) {
        if share(off) > share(self.worst) {
            (self.worst, self.time) = (off, time);
        }
        self.most = [self.most[0].max(off[0]), self.most[1].max(off[1])];
    }

    /// Of what is allowed.
    fn share(&self) -> f64 {
        share(self.most)
    }
}

fn share(off: [f64; 2]) -> f64 {
    (off[0] / MOST_OFF[0]).max(off[1] / MOST_OFF[1])
}

impl<const N: usize> LinePlan<N> {
    fn exact(trajectory: Trajectory<N>) -> Self {
        Self {
            trajectory,
            position_error: 0.0,
            rotation_error: 0.0,
        }
    }

    /// One after the other, with the largest errors.
    fn joined(plans: Vec<Self>) -> Result<Self, TrajectoryError> {
        let largest = |of: fn(&Self) -> f64| plans.iter().map(of).fold(0.0, f64::max);
        let position_error = largest(|plan| plan.position_error);
        let rotation_error = largest(|plan| plan.rotation_error);
        let trajectory = Trajectory::concatenate(plans.into_iter().map(|plan| plan.trajectory))?;
        Ok(Self {
            trajectory,
            position_error,
            rotation_error,
        })
    }
}

/// Without those that go nowhere.
fn lines_between(first: &RigidTransform, poses: &[RigidTransform]) -> Result<Vec<ToolLine>, TrajectoryError> {
    let (mut before, mut lines) = (*first, Vec::with_capacity(poses.len()));
    for (index, pose) in poses.iter().enumerate() {
        let line = ToolLine::between(&before, pose, index + 1);
        if !line.length().is_finite() {
            return Err(kinematics::KinematicsError::PoseNotFinite.into());
        }
        if line.length() > NOWHERE {
            lines.push(line);
            before = *pose;
        }
    }
    Ok(lines)
}

/// Of the places whose joint angles are computed: all events, and evenly between them.
fn times(path: &ToolPath, spacing: f64) -> Vec<f64> {
    let mut times = vec![0.0];
    let way = |time: f64| -> f64 {
        let done = |(line, leg): (&ToolLine, &Leg)| line.length() * leg.phase(time)[0];
        path.lines.iter().zip(&path.legs).map(done).sum()
    };
    for pair in events(&path.legs).windows(2) {
        let pieces = ((way(pair[1]) - way(pair[0])) / spacing).ceil() as usize;
        let pieces = pieces.max(LEAST_PIECES);
        let step = (pair[1] - pair[0]) / pieces as f64;
        times.extend((1..pieces).map(|piece| pair[0] + piece as f64 * step));
        times.push(pair[1]);
    }
    times
}
