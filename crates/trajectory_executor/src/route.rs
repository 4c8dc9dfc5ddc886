//! Ways of the joints around what stands in the way.
//!
//! The direct motion is taken if it is free. Otherwise the tool is lifted straight up first and lowered straight down
//! last, so that it goes across above the obstacles: the lowest of lip and carried object at one of [`CLEAR`]. That is tried
//! for each of a few solutions of the arm for the pose, which differ in where the elbow is, the nearest first; then direct
//! motions to the other solutions; then up, by way of home, and down. The first free way is taken. They are the same every
//! time, and no more than 52.

use devices::JointValues;
use geometry::RigidTransform;
use kinematics::IkOptions;
use nalgebra::SVector;
use trajectory::{Planner, Trajectory};

use crate::error::MotionError;
use crate::handling::Handling;
use crate::model::Model;

/// Heights of the lowest thing at the tool while it goes across, metres: above the bin, above the panels' middle, above
/// the panels.
const CLEAR: [f64; 3] = [0.12, 0.18, 0.26];
/// How far joints may pass by waypoints, radians; then with a stop at each.
const BLENDS: [f64; 2] = [0.2, 0.0];
/// Turns of the third joint, which moves the elbow, from where other solutions are looked for, radians.
const ELBOWS: [f64; 4] = [0.5, -0.5, 1.0, -1.0];
/// Solutions nearer to each other than this are one, radians.
const SAME: f64 = 1e-2;
/// Solutions that are tried.
const MOST_GOALS: usize = 4;
/// Looks for ways of an arm that handles something.
pub(crate) struct Router<'a> {
    pub(crate) model: &'a Model,
    pub(crate) planner: &'a Planner<7>,
    pub(crate) handling: Handling,
}

impl Router<'_> {
    /// To a pose of the tool, from rest to rest.
    ///
    /// # Errors
    /// A pose out of reach; what the direct motion touches, if all ways touch something.
    pub(crate) fn to_pose(&self, at: &JointValues, pose: &RigidTransform) -> Result<Trajectory<7>, MotionError> {
        let nearest = self.solve(pose, at, &IkOptions::default())?;
        let direct = self.free(&[*at, nearest], 0.0);
        if !is_collision(&direct) {
            return direct;
        }
        self.around(at, &self.solutions(pose, at, nearest), direct)
    }

    /// To joint angles (radians), from rest to rest.
    ///
    /// # Errors
    /// Angles outside the limits; what the direct motion touches, if all ways touch something.
    pub(crate) fn to_angles(&self, at: &JointValues, goal: &JointValues) -> Result<Trajectory<7>, MotionError> {
        let direct = self.free(&[*at, *goal], 0.0);
        if !is_collision(&direct) {
            return direct;
        }
        self.around(at, &[*goal], direct)
    }

    /// To joint angles (radians), straight up first: for a cup that may stand in something. None if no such way is free.
    pub(crate) fn lifted(&self, at: &JointValues, goal: &JointValues) -> Option<Trajectory<7>> {
        let mut ways = self.across(at, goal, None).into_iter();
        ways.find_map(|waypoints| self.free(&waypoints, 0.0).ok())
    }

    /// The first goal's direct way was looked at: it is answered with if there is no other.
    fn around(
        &self,
        at: &JointValues,
        goals: &[JointValues],
        direct: Result<Trajectory<7>, MotionError>,
    ) -> Result<Trajectory<7>, MotionError> {
        let others = goals.iter().skip(1).map(|goal| vec![*at, *goal]);
        let across = goals.iter().flat_map(|goal| self.across(at, goal, None));
        let by_home = goals
            .iter()
            .flat_map(|goal| self.across(at, goal, Some(self.model.home)));
        for waypoints in across.chain(others).chain(by_home) {
            for blend in BLENDS {
                let found = self.free(&waypoints, blend);
                if !is_collision(&found) {
                    return found;
                }
                if waypoints.len() == 2 {
                    break;
                }
            }
        }
        direct
    }

    /// Up, over there, and down, for each height that the arm can have at both ends.
    fn across(&self, at: &JointValues, goal: &JointValues, by: Option<JointValues>) -> Vec<Vec<JointValues>> {
        let waypoints = |height: f64| {
            let (up, over) = (self.raised(at, height)?, self.raised(goal, height)?);
            let middle = by.into_iter();
            Some([*at, up].into_iter().chain(middle).chain([over, *goal]).collect())
        };
        CLEAR.into_iter().filter_map(waypoints).collect()
    }

    /// The tool straight above where it is; none if the arm does not get there.
    fn raised(&self, angles: &JointValues, lowest: f64) -> Option<JointValues> {
        let height = lowest + self.handling.carried.map_or(0.0, |carried| carried.length);
        let pose = self.model.chain.forward(&SVector::from(*angles)).ok()?;
        let mut place = pose.translation();
        if place.z >= height {
            return Some(*angles);
        }
        place.z = height;
        let raised = RigidTransform::from_parts(place, pose.rotation());
        self.solve(&raised, angles, &near()).ok()
    }

    /// Of the arm for a pose, the nearest first.
    fn solutions(&self, pose: &RigidTransform, at: &JointValues, nearest: JointValues) -> Vec<JointValues> {
        let turned = |from: JointValues, by: f64| {
            let mut seed = from;
            seed[2] += by;
            seed
        };
        let home = self.model.home;
        let elbows = ELBOWS
            .into_iter()
            .flat_map(|by| [turned(nearest, by), turned(home, by)]);
        let mut found = vec![nearest];
        for seed in std::iter::once(home).chain(elbows) {
            let solution = self.solve(pose, &seed, &near());
            if let Some(solution) = solution
                .ok()
                .filter(|solution| !found.iter().any(|known| is_same(known, solution)))
            {
                found.push(solution);
            }
        }
        found[1..].sort_by(|a, b| longest(a, at).total_cmp(&longest(b, at)));
        found.truncate(MOST_GOALS);
        found
    }

    fn solve(
        &self,
        pose: &RigidTransform,
        seed: &JointValues,
        options: &IkOptions,
    ) -> Result<JointValues, MotionError> {
        let found = self.model.chain.solve(pose, &SVector::from(*seed), options)?;
        Ok(found.angles.into())
    }

    fn free(&self, waypoints: &[JointValues], blend: f64) -> Result<Trajectory<7>, MotionError> {
        let trajectory = self.planner.through(waypoints, blend)?;
        self.model.require_free(&trajectory, &self.handling)?;
        Ok(trajectory)
    }
}

fn is_collision(found: &Result<Trajectory<7>, MotionError>) -> bool {
    matches!(found, Err(MotionError::Collision { .. }))
}

/// Only from the seed: other branches are far away.
fn near() -> IkOptions {
    IkOptions {
        attempts: 1,
        ..IkOptions::default()
    }
}

/// Longest way of a joint, radians.
fn longest(a: &JointValues, b: &JointValues) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn is_same(a: &JointValues, b: &JointValues) -> bool {
    longest(a, b) < SAME
}

#[cfg(test)]
mod tests;
