//! What a motion may touch and what it carries, and whether it is free.
//!
//! The cup (link `vacuum_cup` of the arm's description, its last millimetres) may touch and press no farther than 30 mm from
//! where the tool's way begins and ends; all else keeps the margin always. Where the way ends the cup may press
//! `press_depth` deep, where it begins 2 mm more: it may have come to rest that late.
//!
//! What is carried stands on something where such a way begins, and the cylinder drawn around it reaches into that if the
//! tool is tilted or the cylinder is too long. So over the first 60 mm of the way it may be as near to each thing, or up to
//! 30 mm as deep in it, as it begins, and never nearer or deeper; after that it keeps the margin. That lets it leave what it
//! stands on, and does not let it be pushed into anything.

use collision::{Allowance, ArmModel, CarriedObject, Checker, CollisionError, MotionContact, Shape, Stretch};
use geometry::RigidTransform;
use nalgebra::{SVector, UnitQuaternion, Vector3};
use trajectory::Trajectory;

use crate::error::MotionError;
use crate::model::Model;
use crate::path::TrajectoryPath;

/// The part of the tool that may touch.
const CUP: &str = "vacuum_cup";
/// What holds a carried object.
const HELD_BY: [&str; 2] = ["vacuum_gripper", CUP];
/// Name of what is carried.
const CARRIED: &str = "carried object";
/// The cup may touch no farther from the ends of the tool's way, metres.
const CUP_NEAR: f64 = 0.03;
/// What is carried may touch no farther from the begin of the tool's way, metres.
const CARRIED_NEAR: f64 = 0.06;
/// No deeper than this what is carried may begin in what it stands on, metres.
const MOST_OVERLAP: f64 = 0.03;
/// Places on the way that are looked at to find where that is.
const PLACES: usize = 256;
/// Deeper than `press_depth` where a way begins, metres.
const BEGINS_DEEPER: f64 = 0.002;
/// Nearer than at the begin is what is nearer by this, metres: lines are kept to 0.2 mm.
const NEARER: f64 = 5e-4;
/// A touch that is less deep than this may be missed between looks, metres.
const SHALLOW: f64 = 1e-3;

/// How a motion handles things; by default it touches and carries nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Handling {
    /// The cup may touch near both ends of the way.
    pub(crate) contact: bool,
    pub(crate) carried: Option<Carried>,
}

/// A cylinder about the tool's z axis, from the lip outwards; metres, more than 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Carried {
    pub(crate) radius: f64,
    pub(crate) length: f64,
}

/// A part of a way with what is allowed there.
struct Part {
    from: f64,
    to: f64,
    allowances: Vec<Allowance>,
}

impl Carried {
    fn object(self, arm: &ArmModel<7>) -> Result<CarriedObject, CollisionError> {
        let middle = Vector3::new(0.0, 0.0, 0.5 * self.length);
        let tool_from_middle = RigidTransform::from_parts(middle, UnitQuaternion::identity());
        let shape = Shape::cylinder(&tool_from_middle, self.radius, self.length)?;
        CarriedObject::new(arm, CARRIED, &[shape], &HELD_BY)
    }
}

impl Model {
    /// Refuses a motion with a collision on its way.
    pub(crate) fn require_free(&self, trajectory: &Trajectory<7>, handling: &Handling) -> Result<(), MotionError> {
        let object = handling.carried.map(|carried| carried.object(&self.arm)).transpose()?;
        let checker = Checker::new(&self.arm, &self.scene).with_margin(self.margin)?;
        let checker = object.as_ref().map_or(checker, |object| checker.carrying(object));
        let path = TrajectoryPath::new(trajectory);
        for part in self.parts(trajectory, handling, &checker)? {
            let stretch = Stretch::of(&path, part.from, part.to)?;
            if let Some(found) = checker.allowing(&part.allowances)?.check_motion(&stretch, SHALLOW)? {
                return Err(self.collision(&part, &found));
            }
        }
        Ok(())
    }

    fn parts(
        &self,
        trajectory: &Trajectory<7>,
        handling: &Handling,
        checker: &Checker<'_, 7>,
    ) -> Result<Vec<Part>, MotionError> {
        let mut rules = Vec::new();
        let end = trajectory.duration();
        if handling.contact {
            let way = self.tool_way(trajectory)?;
            rules.push((0.0, way.left(CUP_NEAR), self.pressing(BEGINS_DEEPER)));
            rules.push((way.comes(CUP_NEAR), end, self.pressing(0.0)));
            if handling.carried.is_some() {
                let left = way.left(CARRIED_NEAR);
                let stood_on = self.stood_on(trajectory, checker)?;
                rules.extend(stood_on.into_iter().map(|allowance| (0.0, left, allowance)));
            }
        }
        Ok(parts(end, &rules))
    }

    fn pressing(&self, deeper: f64) -> Allowance {
        Allowance {
            link: CUP.to_owned(),
            obstacle: None,
            margin: -self.press_depth - deeper,
        }
    }

    /// Obstacles that what is carried is near to at the begin: it may stay as near.
    fn stood_on(&self, trajectory: &Trajectory<7>, checker: &Checker<'_, 7>) -> Result<Vec<Allowance>, MotionError> {
        let begin = trajectory.start().map(|state| state.position);
        let mut found = Vec::new();
        for obstacle in self.scene.names() {
            let distance = checker.distance(&begin, CARRIED, obstacle, self.margin)?;
            // What is deeper is no place to stand on: it is a collision at the begin.
            if distance < self.margin && distance >= -MOST_OVERLAP {
                found.push(Allowance {
                    link: CARRIED.to_owned(),
                    obstacle: Some(obstacle.to_owned()),
                    margin: distance - NEARER,
                });
            }
        }
        Ok(found)
    }

    fn tool_way(&self, trajectory: &Trajectory<7>) -> Result<ToolWay, MotionError> {
        let step = trajectory.duration() / PLACES as f64;
        let place = |index: usize| {
            let angles = trajectory.sample(step * index as f64).map(|state| state.position);
            Ok(self.chain.forward(&SVector::from(angles))?.translation())
        };
        let places = (0..=PLACES).map(place).collect::<Result<_, MotionError>>()?;
        Ok(ToolWay { step, places })
    }

    fn collision(&self, part: &Part, found: &MotionContact<'_>) -> MotionError {
        let (link, with) = (found.contact.link, found.contact.with.name());
        let applies = |allowance: &&Allowance| {
            allowance.link == link && allowance.obstacle.as_ref().is_none_or(|obstacle| obstacle == with)
        };
        let allowed = part.allowances.iter().filter(applies).map(|allowance| allowance.margin);
        MotionError::Collision {
            time: part.from + found.time,
            link: link.to_owned(),
            with: with.to_owned(),
            distance_mm: 1e3 * found.contact.distance,
            margin_mm: 1e3 * allowed.fold(self.margin, f64::min),
        }
    }
}

/// Where the tool is, every so many seconds.
struct ToolWay {
    step: f64,
    places: Vec<Vector3<f64>>,
}

impl ToolWay {
    /// The last time, in seconds, before it is first farther than this (metres) from where it begins.
    fn left(&self, distance: f64) -> f64 {
        let is_far = |at: &Vector3<f64>| (at - self.places[0]).norm() > distance;
        let first = self.places.iter().position(is_far);
        self.step * first.map_or(PLACES, |index| index - 1) as f64
    }

    /// The first time, in seconds, after it is last farther than this (metres) from where it ends.
    fn comes(&self, distance: f64) -> f64 {
        let is_far = |at: &Vector3<f64>| (at - self.places[PLACES]).norm() > distance;
        let last = self.places.iter().rposition(is_far);
        self.step * last.map_or(0, |index| index + 1) as f64
    }
}

/// A way of so many seconds, cut where a rule (from, to, what is allowed) begins or ends.
fn parts(end: f64, rules: &[(f64, f64, Allowance)]) -> Vec<Part> {
    let mut cuts: Vec<f64> = rules.iter().flat_map(|(from, to, _)| [*from, to.min(end)]).collect();
    cuts.extend([0.0, end]);
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    let part = |pair: &[f64]| {
        let (from, to) = (pair[0], pair[1]);
        let holds = rules.iter().filter(|rule| rule.0 <= from && to <= rule.1.min(end));
        let allowances = holds.map(|(.., allowance)| allowance.clone()).collect();
        Part { from, to, allowances }
    };
    cuts.windows(2).map(part).collect()
}

#[cfg(test)]
mod tests;
