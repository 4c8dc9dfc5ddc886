//! The arm: its links' shapes, and which of them can touch each other.

use kinematics::Chain;
use nalgebra::SVector;
use urdf_rs::Robot;

use crate::distance::Placed;
use crate::error::CollisionError;
use crate::maths::{Pose, Vector, pose};
use crate::shape::{Ball, Shape};
use crate::urdf::{Carrier, Cylinders, collision_shapes, solid_parent, support};

/// Which pairs of links need no look.
#[derive(Debug, Clone, Copy, Default)]
pub struct SelfCollision<'a, const N: usize> {
    /// Pairs that can never touch, as the arm's maker says. Names the URDF does not have leave nothing out.
    pub never: &'a [[&'a str; 2]],
    /// Joint angles (radians) the arm is known to be free at, its home and zero: pairs whose shapes touch at one of them
    /// do so because shapes are larger than links. They are left out everywhere, so list no pose that is not needed;
    /// [`ArmModel::pairs`] tells what is left.
    pub free_at: &'a [[f64; N]],
}

/// Links of an arm over `N` joints as bodies that move with them.
#[derive(Debug, Clone)]
pub struct ArmModel<const N: usize> {
    pub(crate) chain: Chain<N>,
    pub(crate) links: Vec<Part>,
    pub(crate) pairs: Vec<[usize; 2]>,
    pub(crate) last_from_tool: Pose,
    /// What the joints turn about, in their frames.
    axes: [Vector; N],
}

/// Something that moves with a joint, or with none.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) name: String,
    /// Which joint carries it; none: the base.
    pub(crate) joint: Option<usize>,
    /// In that joint's frame.
    pub(crate) shapes: Vec<Shape>,
    pub(crate) ball: Ball,
}

/// Where the joints are, at some angles.
pub(crate) struct Frames<const N: usize> {
    base_from_joint: [Pose; N],
}

impl<const N: usize> ArmModel<N> {
    /// Collision shapes of `base` and of everything that hangs on the chain's joints. Other links fixed to the base belong
    /// to the scene: [`Scene::from_urdf`](crate::Scene::from_urdf).
    ///
    /// Pairs that are looked at are all but those of one rigid body, neighbours, and what `leave_out` says.
    pub fn from_urdf(
        robot: &Robot,
        base: &str,
        chain: Chain<N>,
        leave_out: &SelfCollision<'_, N>,
    ) -> Result<Self, CollisionError> {
        let frames = chain.joint_frames(&SVector::zeros())?;
        let tool = chain.forward(&SVector::zeros())?;
        let last_from_tool = frames.last().map_or(tool, |last| last.inverse() * tool);
        let axes = chain.joints().each_ref().map(|joint| {
            let axis = joint.axis();
            Vector::new(axis.x, axis.y, axis.z)
        });
        let mut model = Self {
            links: parts(robot, base, &chain)?,
            pairs: Vec::new(),
            last_from_tool: pose(&last_from_tool),
            axes,
            chain,
        };
        model.pairs = model.candidates(robot, leave_out.never);
        model.leave_out_touching(leave_out.free_at)?;
        Ok(model)
    }

    /// The joints.
    pub fn chain(&self) -> &Chain<N> {
        &self.chain
    }

    /// Names of the links that have shapes.
    pub fn link_names(&self) -> impl Iterator<Item = &str> {
        self.links.iter().map(|link| link.name.as_str())
    }

    /// A link's shapes, in the frame of the joint that carries it; none if it has none.
    pub fn shapes(&self, link: &str) -> Option<&[Shape]> {
        let found = self.links.iter().find(|known| known.name == link);
        found.map(|link| link.shapes.as_slice())
    }

    /// The pairs of links that are looked at.
    pub fn pairs(&self) -> impl Iterator<Item = [&str; 2]> {
        self.pairs
            .iter()
            .map(|pair| pair.map(|index| self.links[index].name.as_str()))
    }

    pub(crate) fn frames(&self, angles: &[f64; N]) -> Result<Frames<N>, CollisionError> {
        let frames = self.chain.joint_frames(&SVector::from(*angles))?;
        Ok(Frames {
            base_from_joint: std::array::from_fn(|index| pose(&frames[index])),
        })
    }

    /// How far a ball fixed to something that a joint carries reaches from the joint's axis.
    pub(crate) fn reach_from_axis(&self, frames: &Frames<N>, joint: usize, ball_in_base: &Ball) -> f64 {
        let base_from_joint = &frames.base_from_joint[joint];
        let arm = ball_in_base.centre - base_from_joint.translation;
        let axis = base_from_joint.rotation * self.axes[joint];
        axis.cross(arm).length() + ball_in_base.radius
    }

    fn candidates(&self, robot: &Robot, never: &[[&str; 2]]) -> Vec<[usize; 2]> {
        let is_neighbour = |a: &str, b: &str| solid_parent(robot, a) == Some(b) || solid_parent(robot, b) == Some(a);
        let is_never = |a: &str, b: &str| never.iter().any(|pair| *pair == [a, b] || *pair == [b, a]);
        let mut pairs = Vec::new();
        for (j, second) in self.links.iter().enumerate() {
            for (i, first) in self.links[..j].iter().enumerate() {
                let (a, b) = (first.name.as_str(), second.name.as_str());
                if first.joint != second.joint && !is_neighbour(a, b) && !is_never(a, b) {
                    pairs.push([i, j]);
                }
            }
        }
        pairs
    }

    fn leave_out_touching(&mut self, free_at: &[[f64; N]]) -> Result<(), CollisionError> {
        let frames = free_at
            .iter()
            .map(|angles| self.frames(angles))
            .collect::<Result<Vec<_>, _>>()?;
        let links = &self.links;
        let touch = |[a, b]: [usize; 2], frames: &Frames<N>| links[a].distance(&links[b], frames, 0.0) < 0.0;
        self.pairs
            .retain(|&pair| !frames.iter().any(|frames| touch(pair, frames)));
        Ok(())
    }
}

impl<const N: usize> Frames<N> {
    /// Of a joint's frame, or of the base itself.
    pub(crate) fn of(&self, joint: Option<usize>) -> &Pose {
        joint.map_or(&Pose::IDENTITY, |joint| &self.base_from_joint[joint])
    }
}

impl Part {
    pub(crate) fn new(name: &str, joint: Option<usize>, shapes: Vec<Shape>) -> Self {
        Self {
            name: name.to_owned(),
            joint,
            ball: Ball::around(shapes.iter()),
            shapes,
        }
    }

    pub(crate) fn ball_in_base<const N: usize>(&self, frames: &Frames<N>) -> Ball {
        Ball {
            centre: frames.of(self.joint).transform_point(self.ball.centre),
            radius: self.ball.radius,
        }
    }

    pub(crate) fn placed<'a, const N: usize>(&'a self, frames: &'a Frames<N>) -> impl Iterator<Item = Placed<'a>> {
        let base_from_frame = frames.of(self.joint);
        self.shapes.iter().map(move |shape| Placed { shape, base_from_frame })
    }

    /// Signed distance to another part, or `bound` if it is not below that.
    pub(crate) fn distance<const N: usize>(&self, other: &Self, frames: &Frames<N>, bound: f64) -> f64 {
        let (ball, other_ball) = (self.ball_in_base(frames), other.ball_in_base(frames));
        let mut best = bound;
        if (ball.centre - other_ball.centre).length() - ball.radius - other_ball.radius >= best {
            return best;
        }
        for one in self.placed(frames) {
            let centre = one.centre();
            for two in other.placed(frames) {
                if two.gap_to_point(centre) - one.shape.ball.radius < best {
                    best = one.distance(&two, best);
                }
            }
        }
        best
    }
}

fn parts<const N: usize>(robot: &Robot, base: &str, chain: &Chain<N>) -> Result<Vec<Part>, CollisionError> {
    if robot.links.iter().all(|link| link.name != base) {
        return Err(CollisionError::Unknown {
            what: "link",
            name: base.to_owned(),
        });
    }
    let mut parts = Vec::new();
    for link in robot.links.iter().filter(|link| !link.collision.is_empty()) {
        let support = support(robot, base, &link.name)?;
        let joint = match support.carrier {
            Carrier::Link(_) if link.name == base => None,
            Carrier::Link(_) => continue,
            Carrier::Joint(joint) => Some(chain_joint(chain, joint, link)?),
        };
        let shapes = collision_shapes(link, &support.carrier_from_link, Cylinders::Rounded)?;
        parts.push(Part::new(&link.name, joint, shapes));
    }
    Ok(parts)
}

fn chain_joint<const N: usize>(
    chain: &Chain<N>,
    joint: &urdf_rs::Joint,
    link: &urdf_rs::Link,
) -> Result<usize, CollisionError> {
    let known = chain.joints().iter().position(|known| known.name == joint.name);
    known.ok_or_else(|| CollisionError::ForeignJoint {
        link: link.name.clone(),
        joint: joint.name.clone(),
    })
}
