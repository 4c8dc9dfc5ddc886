//! Planned motions: joints to angles, the tool along a line or an arc.

use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3};

use super::model::Joints;
use super::profile::Trapezoid;

/// What the vendor's client sends as the largest speed of the tool's rotation, rad/s, and its acceleration.
const ROTATION: [f64; 2] = [2.3, 4.5];

/// Where a motion goes.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Way {
    /// Radians.
    Joints { from: Joints, to: Joints },
    /// `base_from_tool`.
    Line { from: RigidTransform, to: RigidTransform },
    /// The origin turns about an axis through a centre, the rotation goes from one to the other.
    Arc {
        from: RigidTransform,
        to: RigidTransform,
        centre: Vector3<f64>,
        /// Its length is the angle, radians.
        turn: Vector3<f64>,
    },
}

/// A place on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    Joints(Joints),
    Tool(RigidTransform),
}

/// A motion with its time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Segment {
    way: Way,
    profile: Trapezoid,
    time: f64,
    /// Length of the way (metres or radians) that is given to the rounded corner; none for a full stop.
    pub(super) blend: Option<f64>,
}

impl Segment {
    /// Speed and acceleration of the joint that moves most (rad), or of the tool (m).
    pub(super) fn new(way: Way, speed: f64, acceleration: f64, blend: Option<f64>) -> Self {
        let profile = match &way {
            Way::Joints { from, to } => {
                let longest = (0..7).map(|joint| (to[joint] - from[joint]).abs()).fold(0.0, f64::max);
                Trapezoid::new(longest, speed, acceleration)
            }
            Way::Line { from, to } => {
                let length = (to.translation() - from.translation()).norm();
                slower(length, speed, acceleration, from.rotation().angle_to(&to.rotation()))
            }
            Way::Arc { from, to, centre, turn } => {
                let length = turn.norm() * (from.translation() - centre).norm();
                slower(length, speed, acceleration, from.rotation().angle_to(&to.rotation()))
            }
        };
        Self {
            way,
            profile,
            time: 0.0,
            blend,
        }
    }

    pub(super) fn advance(&mut self, seconds: f64) {
        self.time += seconds;
    }

    pub(super) fn is_over(&self) -> bool {
        self.time >= self.profile.duration()
    }

    pub(super) fn place(&self) -> Place {
        self.at(self.profile.share(self.time))
    }

    pub(super) fn end(&self) -> Place {
        self.at(1.0)
    }

    /// Whether the next motion begins, so that the corner between both is rounded.
    pub(super) fn lets_next_begin(&self) -> bool {
        let left = self.profile.duration() - self.time;
        self.blend
            .is_some_and(|way| left <= self.profile.time_left(way.min(self.profile.length())))
    }

    fn at(&self, share: f64) -> Place {
        match &self.way {
            Way::Joints { from, to } => Place::Joints(std::array::from_fn(|joint| {
                from[joint] + share * (to[joint] - from[joint])
            })),
            Way::Line { from, to } => Place::Tool(from.interpolate(to, share)),
            Way::Arc { from, to, centre, turn } => {
                let turned = UnitQuaternion::from_scaled_axis(turn * share);
                let origin = centre + turned * (from.translation() - centre);
                Place::Tool(RigidTransform::from_parts(
                    origin,
                    from.interpolate(to, share).rotation(),
                ))
            }
        }
    }
}

/// The profile of way or rotation, whichever takes longer.
fn slower(length: f64, speed: f64, acceleration: f64, angle: f64) -> Trapezoid {
    let (way, rotation) = (
        Trapezoid::new(length, speed, acceleration),
        Trapezoid::new(angle, ROTATION[0], ROTATION[1]),
    );
    if way.duration() >= rotation.duration() {
        way
    } else {
        rotation
    }
}

impl Place {
    /// What `next` has moved since its begin, added: rounds the corner between two motions.
    pub(super) fn plus(self, next: &Segment) -> Self {
        match (self, next.at(0.0), next.place()) {
            (Self::Joints(place), Self::Joints(start), Self::Joints(now)) => {
                Self::Joints(std::array::from_fn(|joint| place[joint] + now[joint] - start[joint]))
            }
            (Self::Tool(place), Self::Tool(start), Self::Tool(now)) => {
                let origin = place.translation() + now.translation() - start.translation();
                let rotation = now.rotation() * start.rotation().inverse() * place.rotation();
                Self::Tool(RigidTransform::from_parts(origin, rotation))
            }
            _ => self,
        }
    }

    pub(super) fn is_of_kind(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }
}
