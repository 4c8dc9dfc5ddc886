//! Straight lines of the tool, one after the other, by minimum jerk.

use geometry::RigidTransform;
use nalgebra::{UnitQuaternion, Vector3, Vector6};

use crate::schedule::Leg;

/// What a turn counts as, beside a shift: a tool of this length, metres per radian.
const TOOL_LENGTH: f64 = 0.1;

/// A straight way of the tool with a turn about a fixed axis, both in the axes of the arm's base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ToolLine {
    /// That of the pose it leads to, 1 for the first.
    pub(crate) number: usize,
    /// Metres.
    pub(crate) shift: Vector3<f64>,
    /// Axis times angle, radians: the shortest arc.
    turn: Vector3<f64>,
}

/// Lines and when they are taken.
#[derive(Debug, Clone)]
pub(crate) struct ToolPath<'a> {
    pub(crate) start: RigidTransform,
    pub(crate) lines: &'a [ToolLine],
    /// One for each line.
    pub(crate) legs: Vec<Leg>,
}

/// Where the tool should be at a time, and how it should move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ToolState {
    /// `base_from_tool`.
    pub(crate) pose: RigidTransform,
    pub(crate) motion: ToolMotion,
    /// Its derivative.
    pub(crate) change: ToolMotion,
}

/// How the tool moves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ToolMotion {
    /// Velocity (m/s), angular velocity (rad/s), axes of the base.
    pub(crate) twist: Vector6<f64>,
    /// Way per time, m/s.
    pub(crate) progress: f64,
}

impl ToolLine {
    pub(crate) fn between(from: &RigidTransform, to: &RigidTransform, number: usize) -> Self {
        Self {
            number,
            shift: to.translation() - from.translation(),
            turn: (to.rotation() * from.rotation().inverse()).scaled_axis(),
        }
    }

    /// Shift and turn, as a way in metres.
    pub(crate) fn way(&self) -> [f64; 6] {
        let turn = self.turn * TOOL_LENGTH;
        [self.shift.x, self.shift.y, self.shift.z, turn.x, turn.y, turn.z]
    }

    /// Metres.
    pub(crate) fn length(&self) -> f64 {
        self.way().iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}

impl ToolPath<'_> {
    /// Shifts add up; turns follow each other, each about its own axis, and turn the angular velocity of those before.
    pub(crate) fn at(&self, time: f64) -> ToolState {
        let (mut translation, mut rotation) = (self.start.translation(), self.start.rotation());
        let mut shifts = [Vector3::zeros(); 2];
        let mut turns = [Vector3::zeros(); 2];
        let mut progress = [0.0; 2];
        for (line, leg) in self.lines.iter().zip(&self.legs) {
            let [share, speed, acceleration] = leg.phase(time);
            translation += line.shift * share;
            shifts[0] += line.shift * speed;
            shifts[1] += line.shift * acceleration;
            let turned = UnitQuaternion::from_scaled_axis(line.turn * share);
            let own = line.turn * speed;
            let before = [turned * turns[0], turned * turns[1]];
            turns[0] = own + before[0];
            turns[1] = line.turn * acceleration + before[1] + own.cross(&before[0]);
            rotation = turned * rotation;
            progress[0] += line.length() * speed;
            progress[1] += line.length() * acceleration;
        }
        let motion = |order: usize| ToolMotion {
            twist: stacked(&shifts[order], &turns[order]),
            progress: progress[order],
        };
        ToolState {
            pose: RigidTransform::from_parts(translation, rotation),
            motion: motion(0),
            change: motion(1),
        }
    }

    /// Number of the last line that has begun, and how much of it is done: percent, millimetres.
    pub(crate) fn place(&self, time: f64) -> (usize, f64, f64) {
        let index = self.legs.iter().rposition(|leg| leg.begin < time).unwrap_or(0);
        let (line, share) = (&self.lines[index], self.legs[index].phase(time)[0]);
        (line.number, 100.0 * share, 1e3 * share * line.shift.norm())
    }
}

fn stacked(upper: &Vector3<f64>, lower: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(upper.x, upper.y, upper.z, lower.x, lower.y, lower.z)
}

/// From one pose to another: metres and a rotation vector in radians, axes of the base.
pub(crate) fn pose_error(from: &RigidTransform, to: &RigidTransform) -> Vector6<f64> {
    let turn = (to.rotation() * from.rotation().inverse()).scaled_axis();
    stacked(&(to.translation() - from.translation()), &turn)
}

/// Metres and radians.
pub(crate) fn sizes(error: &Vector6<f64>) -> [f64; 2] {
    [error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::schedule;

    #[test]
    fn motion_and_change_are_the_derivatives_of_the_pose() {
        let turned = |axis: [f64; 3]| UnitQuaternion::from_scaled_axis(Vector3::from(axis));
        let start = RigidTransform::from_parts(Vector3::new(0.3, 0.1, 0.2), turned([0.4, -1.0, 0.3]));
        let corner = RigidTransform::from_parts(Vector3::new(0.5, 0.0, 0.1), turned([1.2, 0.5, -0.8]));
        let end = RigidTransform::from_parts(Vector3::new(0.4, 0.3, 0.3), turned([-0.3, 1.1, 0.9]));
        let path = ToolPath {
            start,
            lines: &[
                ToolLine::between(&start, &corner, 1),
                ToolLine::between(&corner, &end, 2),
            ],
            legs: schedule(&[1.0, 0.8], &[0.35]),
        };
        let step = 1e-5;
        for index in 0..=145 {
            let time = 0.01 * f64::from(index);
            let (before, now, after) = (path.at(time - step), path.at(time), path.at(time + step));
            let twist = pose_error(&before.pose, &after.pose) / (2.0 * step);
            assert!(
                (twist - now.motion.twist).norm() < 1e-6,
                "{time}: {twist} {:?}",
                now.motion
            );
            let change = (after.motion.twist - before.motion.twist) / (2.0 * step);
            // At a leg's begin the change itself has a kink.
            assert!(
                (change - now.change.twist).norm() < 2e-3,
                "{time}: {change} {:?}",
                now.change
            );
            let progress = (after.motion.progress - before.motion.progress) / (2.0 * step);
            assert!((progress - now.change.progress).abs() < 2e-3);
        }
        let last = path.at(1.45).pose;
        assert!(sizes(&pose_error(&last, &end)).iter().all(|off| *off < 1e-12));
        assert_eq!(path.place(0.3).0, 1);
        assert_eq!(path.place(1.3).0, 2);
    }
}
