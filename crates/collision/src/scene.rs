//! What stands around the arm.

use std::sync::Arc;

use geometry::{RigidTransform, TriangleMesh};
use nalgebra::{Point3, Unit, Vector3};
use urdf_rs::Robot;

use crate::arm::{Frames, Part};
use crate::cloud::PointCloud;
use crate::distance::Placed;
use crate::error::{CollisionError, require, require_finite, require_length};
use crate::maths::{Vector, pose};
use crate::shape::{Ball, Shape};
use crate::urdf::{Carrier, Cylinders, collision_shapes, support};

/// Obstacles with names, in the base frame. Cheap to clone, clouds and meshes are shared: so each phase of a task can
/// have its own exceptions.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    pub(crate) obstacles: Vec<Obstacle>,
}

#[derive(Debug, Clone)]
pub(crate) struct Obstacle {
    pub(crate) name: String,
    body: Body,
    /// Links and carried objects that may touch it.
    excepted: Vec<String>,
}

#[derive(Debug, Clone)]
enum Body {
    Shapes { shapes: Arc<[Shape]>, ball: Ball },
    HalfSpace { normal: Vector, offset: f64 },
    Cloud(Arc<PointCloud>),
}

/// A bin that is open towards the z axis of its frame, whose origin is in the middle of the floor's inner side. Metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Clear lengths along its x and y axes and its clear height.
    pub inside: [f64; 3],
    /// Thickness of the floor and of the four walls.
    pub wall: f64,
}

impl Scene {
    /// Nothing around.
    pub fn new() -> Self {
        Self::default()
    }

    /// Every link with collision shapes that is fixed to `base`, but not `base` itself, by its name.
    pub fn from_urdf(robot: &Robot, base: &str) -> Result<Self, CollisionError> {
        if robot.links.iter().all(|link| link.name != base) {
            return Err(unknown("link", base));
        }
        let mut scene = Self::new();
        let solid = robot.links.iter().filter(|link| !link.collision.is_empty());
        for link in solid.filter(|link| link.name != base) {
            let found = support(robot, base, &link.name)?;
            if matches!(found.carrier, Carrier::Link(name) if name == base) {
                let shapes = collision_shapes(link, &found.carrier_from_link, Cylinders::Flat)?;
                scene.add(&link.name, shapes)?;
            }
        }
        Ok(scene)
    }

    /// An obstacle of one or more shapes in the base frame.
    pub fn add(&mut self, name: &str, shapes: Vec<Shape>) -> Result<(), CollisionError> {
        if shapes.is_empty() {
            return Err(CollisionError::Body {
                place: format!("obstacle `{name}`"),
                reason: "no shapes".to_owned(),
            });
        }
        let ball = Ball::around(shapes.iter());
        let shapes = shapes.into();
        self.push(name, Body::Shapes { shapes, ball })
    }

    /// A box; `size` is its full lengths along its axes.
    pub fn add_box(
        &mut self,
        name: &str,
        base_from_box: &RigidTransform,
        size: [f64; 3],
    ) -> Result<(), CollisionError> {
        self.add(name, vec![Shape::cuboid(base_from_box, size)?])
    }

    /// All points with `normal · point <= offset` (metres): a table is what is below its top.
    pub fn add_half_space(
        &mut self,
        name: &str,
        normal: &Unit<Vector3<f64>>,
        offset: f64,
    ) -> Result<(), CollisionError> {
        let place = format!("half-space `{name}`");
        require_finite(&place, "offset", &[offset])?;
        let length = normal.norm();
        require(&place, "length of the normal", length, (length - 1.0).abs() < 1e-6, "1")?;
        let normal = Vector::new(normal.x, normal.y, normal.z);
        self.push(name, Body::HalfSpace { normal, offset })
    }

    /// Five boxes.
    pub fn add_bin(&mut self, name: &str, base_from_bin: &RigidTransform, bin: &Bin) -> Result<(), CollisionError> {
        let shapes = bin.shapes(base_from_bin)?;
        self.add(name, shapes)
    }

    /// A surface of triangles; see [`Shape::mesh`].
    pub fn add_mesh(
        &mut self,
        name: &str,
        base_from_mesh: &RigidTransform,
        mesh: &TriangleMesh,
    ) -> Result<(), CollisionError> {
        self.add(name, vec![Shape::mesh(mesh)?.moved(&pose(base_from_mesh))])
    }

    /// The convex hull of points in the base frame.
    pub fn add_convex_hull(&mut self, name: &str, points: &[Point3<f64>]) -> Result<(), CollisionError> {
        self.add(name, vec![Shape::convex_hull(points)?])
    }

    /// What cameras saw. To let a cup touch the object it picks, add the object's points as a cloud of their own and
    /// except that.
    pub fn add_cloud(&mut self, name: &str, cloud: Arc<PointCloud>) -> Result<(), CollisionError> {
        self.push(name, Body::Cloud(cloud))
    }

    /// Takes an obstacle away.
    pub fn remove(&mut self, name: &str) -> Result<(), CollisionError> {
        let index = self.position(name)?;
        self.obstacles.remove(index);
        Ok(())
    }

    /// Lets a link or a carried object touch an obstacle. A name that nothing has lets nothing touch it.
    pub fn except(&mut self, link: &str, obstacle: &str) -> Result<(), CollisionError> {
        let index = self.position(obstacle)?;
        self.obstacles[index].excepted.push(link.to_owned());
        Ok(())
    }

    /// In the order they are looked at.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.obstacles.iter().map(|obstacle| obstacle.name.as_str())
    }

    fn position(&self, name: &str) -> Result<usize, CollisionError> {
        let index = self.obstacles.iter().position(|obstacle| obstacle.name == name);
        index.ok_or_else(|| unknown("obstacle", name))
    }

    fn push(&mut self, name: &str, body: Body) -> Result<(), CollisionError> {
        if self.position(name).is_ok() {
            return Err(CollisionError::NameTaken { name: name.to_owned() });
        }
        self.obstacles.push(Obstacle {
            name: name.to_owned(),
            body,
            excepted: Vec::new(),
        });
        Ok(())
    }
}

impl Bin {
    /// Floor and walls, in the frame `target_from_bin` leads to.
    pub fn shapes(&self, target_from_bin: &RigidTransform) -> Result<Vec<Shape>, CollisionError> {
        for length in self.inside {
            require_length("bin", "inside", length)?;
        }
        require_length("bin", "wall", self.wall)?;
        let ([x, y, z], wall) = (self.inside, self.wall);
        let (aside_x, aside_y) = (0.5 * (x + wall), 0.5 * (y + wall));
        let (across_x, across_y) = ([wall, y + 2.0 * wall, z], [x, wall, z]);
        let floor = ([0.0, 0.0, -0.5 * wall], [x + 2.0 * wall, y + 2.0 * wall, wall]);
        let walls = [
            ([aside_x, 0.0, 0.5 * z], across_x),
            ([-aside_x, 0.0, 0.5 * z], across_x),
            ([0.0, aside_y, 0.5 * z], across_y),
            ([0.0, -aside_y, 0.5 * z], across_y),
        ];
        let shape = |(middle, size): ([f64; 3], [f64; 3])| {
            let bin_from_box = RigidTransform::from_parts(middle.into(), nalgebra::UnitQuaternion::identity());
            Shape::cuboid(&(*target_from_bin * bin_from_box), size)
        };
        std::iter::once(floor).chain(walls).map(shape).collect()
    }
}

impl Obstacle {
    pub(crate) fn excepts(&self, part: &Part) -> bool {
        self.excepted.contains(&part.name)
    }

    /// Signed distance to a part of the arm, or `bound` if it is not below that.
    pub(crate) fn distance<const N: usize>(&self, part: &Part, frames: &Frames<N>, bound: f64) -> f64 {
        let ball = part.ball_in_base(frames);
        match &self.body {
            Body::Shapes { shapes, ball: own } => {
                let apart = (ball.centre - own.centre).length() - ball.radius - own.radius;
                if apart >= bound {
                    return bound;
                }
                shapes.iter().fold(bound, |best, shape| {
                    distance_to_shape(&shape.unmoved(), part, &ball, frames, best)
                })
            }
            &Body::HalfSpace { normal, offset } => {
                if normal.dot(ball.centre) - offset - ball.radius >= bound {
                    return bound;
                }
                part.placed(frames).fold(bound, |best, placed| {
                    placed.distance_to_half_space(normal, offset, best)
                })
            }
            Body::Cloud(cloud) => part
                .placed(frames)
                .fold(bound, |best, placed| placed.distance_to_cloud(cloud, best)),
        }
    }
}

fn distance_to_shape<const N: usize>(
    shape: &Placed<'_>,
    part: &Part,
    ball: &Ball,
    frames: &Frames<N>,
    bound: f64,
) -> f64 {
    if shape.gap_to_point(ball.centre) - ball.radius >= bound {
        return bound;
    }
    part.placed(frames).fold(bound, |best, placed| {
        if shape.gap_to_point(placed.centre()) - placed.shape.ball.radius < best {
            placed.distance(shape, best)
        } else {
            best
        }
    })
}

pub(crate) fn unknown(what: &'static str, name: &str) -> CollisionError {
    CollisionError::Unknown {
        what,
        name: name.to_owned(),
    }
}
