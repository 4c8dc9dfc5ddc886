//! Bodies, each fixed in the frame of whatever carries it.

use geometry::{RigidTransform, TriangleMesh};
use nalgebra::Point3;
use parry3d_f64::shape::{SharedShape, TriMesh, TriMeshFlags};

use crate::error::{CollisionError, require_finite, require_length};
use crate::maths::{Pose, Vector, pose, vector};
use crate::segment::Segment;

/// A body in the frame of what carries it (a link, the tool, the base). Metres.
#[derive(Clone)]
pub struct Shape {
    pub(crate) form: Form,
    pub(crate) ball: Ball,
}

/// Capsules and boxes have distance routines of their own; the rest goes to the library.
#[derive(Clone)]
pub(crate) enum Form {
    Capsule { core: Segment, radius: f64 },
    Cuboid(OrientedBox),
    Other(Other),
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct OrientedBox {
    pub(crate) frame_from_box: Pose,
    pub(crate) half: Vector,
}

#[derive(Clone)]
pub(crate) struct Other {
    pub(crate) shape: SharedShape,
    pub(crate) frame_from_shape: Pose,
    /// Holds the shape: what is far from it needs no closer look.
    pub(crate) bounds: OrientedBox,
}

/// Holds a whole shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ball {
    pub(crate) centre: Vector,
    pub(crate) radius: f64,
}

impl Ball {
    /// Around all of them: around the box of their boxes, which is near the smallest for what arms are made of.
    pub(crate) fn around<'a>(shapes: impl Iterator<Item = &'a Shape> + Clone) -> Self {
        let of = |sign: f64| {
            shapes
                .clone()
                .map(move |shape| shape.ball.centre + Vector::splat(sign * shape.ball.radius))
        };
        let low = of(-1.0).fold(Vector::INFINITY, Vector::min);
        let high = of(1.0).fold(Vector::NEG_INFINITY, Vector::max);
        let centre = 0.5 * (low + high);
        let reach = |shape: &Shape| (shape.ball.centre - centre).length() + shape.ball.radius;
        let radius = shapes.map(reach).fold(0.0, f64::max);
        Self { centre, radius }
    }
}

impl Shape {
    /// A ball.
    pub fn sphere(centre: &Point3<f64>, radius: f64) -> Result<Self, CollisionError> {
        Self::capsule(centre, centre, radius)
    }

    /// All that is no farther than `radius` from the way between two points.
    pub fn capsule(from: &Point3<f64>, to: &Point3<f64>, radius: f64) -> Result<Self, CollisionError> {
        for end in [from, to] {
            require_finite("capsule", "end", end.coords.as_slice())?;
        }
        require_length("capsule", "radius", radius)?;
        let core = Segment {
            from: vector(from),
            to: vector(to),
        };
        let ball = Ball {
            centre: 0.5 * (core.from + core.to),
            radius: 0.5 * (core.to - core.from).length() + radius,
        };
        let form = Form::Capsule { core, radius };
        Ok(Self { form, ball })
    }

    /// A box with its middle and axes at those of `frame_from_box`; `size` is its full lengths along x, y and z.
    pub fn cuboid(frame_from_box: &RigidTransform, size: [f64; 3]) -> Result<Self, CollisionError> {
        require_finite("box", "position", frame_from_box.translation().as_slice())?;
        for length in size {
            require_length("box", "size", length)?;
        }
        let cuboid = OrientedBox {
            frame_from_box: pose(frame_from_box),
            half: 0.5 * Vector::from(size),
        };
        Ok(Self {
            ball: cuboid.ball(),
            form: Form::Cuboid(cuboid),
        })
    }

    /// A cylinder with flat ends, its middle at the origin of `frame_from_cylinder` and its axis along z.
    pub fn cylinder(frame_from_cylinder: &RigidTransform, radius: f64, length: f64) -> Result<Self, CollisionError> {
        require_finite("cylinder", "position", frame_from_cylinder.translation().as_slice())?;
        require_length("cylinder", "radius", radius)?;
        require_length("cylinder", "length", length)?;
        // The library's cylinders stand along y.
        let quarter = Pose::rotation(Vector::X * std::f64::consts::FRAC_PI_2);
        let shape = SharedShape::cylinder(0.5 * length, radius);
        Ok(Self::other(shape, pose(frame_from_cylinder) * quarter))
    }

    /// The smallest body without dents that holds all of the points.
    ///
    /// # Errors
    /// Points that are no numbers or all lie in one plane.
    pub fn convex_hull(points: &[Point3<f64>]) -> Result<Self, CollisionError> {
        for point in points {
            require_finite("convex hull", "point", point.coords.as_slice())?;
        }
        let vectors: Vec<Vector> = points.iter().map(vector).collect();
        // The library's hull is not made for points in one plane.
        let hull = is_solid(&vectors).then(|| SharedShape::convex_hull(&vectors)).flatten();
        let shape = hull.ok_or_else(|| CollisionError::Body {
            place: "convex hull".to_owned(),
            reason: format!("{} points that span no volume", points.len()),
        })?;
        Ok(Self::other(shape, Pose::identity()))
    }

    /// A surface of triangles. What lies wholly within it touches it only if the surface is closed and its corners run
    /// counter-clockwise seen from outside.
    pub fn mesh(mesh: &TriangleMesh) -> Result<Self, CollisionError> {
        let refuse = |reason: String| CollisionError::Body {
            place: "mesh".to_owned(),
            reason,
        };
        mesh.check().map_err(|error| refuse(error.to_string()))?;
        let vertices: Vec<Vector> = mesh.vertices.iter().map(vector).collect();
        let flags = TriMeshFlags::MERGE_DUPLICATE_VERTICES;
        let mut surface =
            TriMesh::with_flags(vertices, mesh.triangles.clone(), flags).map_err(|error| refuse(error.to_string()))?;
        if is_closed(surface.indices()) {
            surface
                .set_flags(flags | TriMeshFlags::ORIENTED)
                .map_err(|error| refuse(error.to_string()))?;
        }
        Ok(Self::other(SharedShape::new(surface), Pose::identity()))
    }

    fn other(shape: SharedShape, frame_from_shape: Pose) -> Self {
        let bounds = shape.compute_local_aabb();
        let bounds = OrientedBox {
            frame_from_box: frame_from_shape * Pose::from_translation(bounds.center()),
            half: bounds.half_extents(),
        };
        Self {
            ball: bounds.ball(),
            form: Form::Other(Other {
                shape,
                frame_from_shape,
                bounds,
            }),
        }
    }

    /// The same body in the frame of which `target_from_frame` tells.
    pub(crate) fn moved(&self, target_from_frame: &Pose) -> Self {
        let mut moved = self.clone();
        moved.ball.centre = target_from_frame.transform_point(self.ball.centre);
        match &mut moved.form {
            Form::Capsule { core, .. } => *core = core.moved(target_from_frame),
            Form::Cuboid(cuboid) => cuboid.frame_from_box = *target_from_frame * cuboid.frame_from_box,
            Form::Other(other) => {
                other.frame_from_shape = *target_from_frame * other.frame_from_shape;
                other.bounds.frame_from_box = *target_from_frame * other.bounds.frame_from_box;
            }
        }
        moved
    }
}

impl Segment {
    pub(crate) fn moved(&self, target_from_frame: &Pose) -> Self {
        Self {
            from: target_from_frame.transform_point(self.from),
            to: target_from_frame.transform_point(self.to),
        }
    }
}

impl OrientedBox {
    fn ball(&self) -> Ball {
        Ball {
            centre: self.frame_from_box.translation,
            radius: self.half.length(),
        }
    }
}

/// Four of the points, each as far as can be from those before, are not in one plane.
fn is_solid(points: &[Vector]) -> bool {
    let Some(&origin) = points.first() else { return false };
    let farthest = |measure: &dyn Fn(Vector) -> f64| {
        let longer = |best: Vector, point: &Vector| if measure(*point) > measure(best) { *point } else { best };
        points.iter().fold(origin, longer)
    };
    let along = farthest(&|point| (point - origin).length()) - origin;
    let aside = farthest(&|point| (point - origin).cross(along).length()) - origin;
    let normal = along.cross(aside);
    let off = farthest(&|point| (point - origin).dot(normal).abs()) - origin;
    off.dot(normal).abs() > FLATTEST * along.length().powi(3)
}

/// Least volume of the box of a convex body for its length 1.
const FLATTEST: f64 = 1e-9;

/// Each edge is run once in either direction.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut edges: Vec<(u32, u32)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .collect();
    edges.sort_unstable();
    let is_once = edges.windows(2).all(|pair| pair[0] != pair[1]);
    is_once && edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok())
}

impl std::fmt::Debug for Shape {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.form {
            Form::Capsule { core, radius } => {
                write!(formatter, "capsule {} to {}, radius {radius}", core.from, core.to)
            }
            Form::Cuboid(cuboid) => write!(formatter, "{cuboid:?}"),
            Form::Other(other) => write!(formatter, "{:?} within {:?}", other.shape.shape_type(), other.bounds),
        }
    }
}
