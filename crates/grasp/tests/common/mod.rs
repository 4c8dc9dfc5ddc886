//! Bodies on a table, seen by two cameras: exact normals, depths, masks and edges.
#![allow(dead_code, reason = "each test and example uses its part")]

use geometry::nalgebra::{Matrix3, Point2, Point3, Rotation3, UnitQuaternion, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use grasp::ViewInput;
use imaging::{Image, Mask};

/// Neighbouring depths that differ by more have an edge between them, metres.
const STEP: f64 = 0.0012;

/// A convex body.
#[derive(Debug, Clone)]
pub(crate) enum Body {
    /// Where `normal · point <= offset` for all faces.
    Polyhedron(Vec<(Vector3<f64>, f64)>),
    Sphere {
        centre: Point3<f64>,
        radius: f64,
    },
    /// Lies along y.
    Cylinder {
        centre: Point3<f64>,
        radius: f64,
        half_length: f64,
    },
}

impl Body {
    /// A block of some size with its middle at a place.
    pub(crate) fn block(centre: Point3<f64>, size: [f64; 3], rotation: Rotation3<f64>) -> Self {
        let faces = (0..6).map(|face| {
            let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
            let normal = rotation * (Vector3::ith(face / 2, sign));
            (normal, normal.dot(&centre.coords) + size[face / 2] / 2.0)
        });
        Self::Polyhedron(faces.collect())
    }

    /// A pyramid with a square base on the table.
    pub(crate) fn pyramid(middle: [f64; 2], side: f64, height: f64, turned: f64) -> Self {
        let flank = |k: usize| {
            let (sin, cos) = (turned + std::f64::consts::FRAC_PI_2 * k as f64).sin_cos();
            let normal = Vector3::new(cos * height, sin * height, side / 2.0).normalize();
            (normal, normal.dot(&Vector3::new(middle[0], middle[1], height)))
        };
        let faces = (0..4).map(flank).chain([(-Vector3::z(), 0.0)]);
        Self::Polyhedron(faces.collect())
    }

    /// Distance in multiples of the direction, and normal.
    pub(crate) fn hit(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        match self {
            Self::Polyhedron(faces) => enter(faces.iter().copied(), origin, direction),
            Self::Sphere { centre, radius } => {
                let distance = first_root(&(origin - centre), direction, *radius)?;
                Some((distance, (origin + direction * distance - centre) / *radius))
            }
            Self::Cylinder {
                centre,
                radius,
                half_length,
            } => {
                let across = Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 1.0));
                let distance = first_root(&(across * (origin - centre)), &(across * direction), *radius)?;
                let point = origin + direction * distance;
                let normal = across * (point - centre) / *radius;
                ((point.y - centre.y).abs() <= *half_length).then_some((distance, normal))
            }
        }
    }
}

fn enter(
    faces: impl Iterator<Item = (Vector3<f64>, f64)>,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<(f64, Vector3<f64>)> {
    let (mut first, mut last, mut normal) = (0.0_f64, f64::INFINITY, Vector3::zeros());
    for (face, offset) in faces {
        let (height, rate) = (face.dot(&origin.coords) - offset, face.dot(direction));
        let at = -height / rate;
        if rate < 0.0 && at > first {
            (first, normal) = (at, face);
        } else if rate > 0.0 {
            last = last.min(at);
        } else if rate == 0.0 && height > 0.0 {
            return None;
        }
    }
    (first > 0.0 && first < last).then_some((first, normal))
}

fn first_root(from: &Vector3<f64>, direction: &Vector3<f64>, radius: f64) -> Option<f64> {
    let (a, b) = (direction.norm_squared(), from.dot(direction));
    let root = b * b - a * (from.norm_squared() - radius * radius);
    (root >= 0.0)
        .then(|| (-b - root.sqrt()) / a)
        .filter(|distance| *distance > 0.0)
}

/// One view's images.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) name: &'static str,
    pub(crate) camera: PinholeCamera,
    pub(crate) base_from_camera: RigidTransform,
    pub(crate) normals: Image<[f32; 3]>,
    pub(crate) confidence: Image<f32>,
    pub(crate) edges: Mask,
    pub(crate) edge_confidence: Image<f32>,
    pub(crate) mask: Mask,
    pub(crate) depth: Image<f32>,
}

impl Seen {
    pub(crate) fn input(&self) -> ViewInput<'_> {
        ViewInput {
            name: self.name,
            camera: self.camera,
            base_from_camera: self.base_from_camera,
            normals: &self.normals,
            confidence: &self.confidence,
            edges: &self.edges,
            edge_confidence: &self.edge_confidence,
            mask: &self.mask,
            depth: Some(&self.depth),
        }
    }
}

/// Inputs of both views.
pub(crate) fn inputs(seen: &[Seen; 2]) -> [ViewInput<'_>; 2] {
    [seen[0].input(), seen[1].input()]
}

/// Cameras like the cell's: one looks down, one from the side; square images of some size.
pub(crate) fn cameras(size: usize) -> [(&'static str, PinholeCamera, RigidTransform); 2] {
    let camera = |focal: f64| {
        let (focal, middle) = (focal * size as f64, (size as f64 - 1.0) / 2.0);
        PinholeCamera::new(size, size, [focal; 2], [middle; 2]).unwrap()
    };
    let above = look_at(Point3::new(0.412, -0.008, 0.331), Point3::new(0.43, 0.0, 0.01));
    let beside = look_at(Point3::new(0.329, 0.130, 0.409), Point3::new(0.43, 0.0, 0.01));
    [("c1", camera(1.42), above), ("c2", camera(1.89), beside)]
}

fn look_at(from: Point3<f64>, to: Point3<f64>) -> RigidTransform {
    let forward = (to - from).normalize();
    let right = forward.cross(&Vector3::x()).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    RigidTransform::from_parts(from.coords, rotation)
}

/// Both views of some bodies on a table at z = 0; normals are off by `noise` radians RMS in each axis.
pub(crate) fn see(bodies: &[Body], size: usize, noise: f64) -> [Seen; 2] {
    cameras(size).map(|(name, camera, base_from_camera)| view(bodies, name, camera, base_from_camera, noise))
}

fn view(bodies: &[Body], name: &'static str, camera: PinholeCamera, pose: RigidTransform, noise: f64) -> Seen {
    let (width, height) = (camera.width(), camera.height());
    let origin = Point3::from(pose.translation());
    let look = |x: usize, y: usize| {
        let ray = camera.unproject(&Point2::new(x as f64, y as f64)).unwrap();
        let direction = pose.transform_direction(&ray);
        let hits = bodies.iter().filter_map(|body| body.hit(&origin, &direction));
        let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map_or((-origin.z / direction.z, None), |(depth, normal)| (depth, Some(normal)))
    };
    let seen = Image::from_fn(width, height, look);
    let mask = Mask::from_nonzero(&seen.map(|(_, normal)| u8::from(normal.is_some())));
    let depth = seen.map(|(depth, normal)| if normal.is_some() { *depth as f32 } else { f32::NAN });
    let edges = edges(&seen, &|x, y, depth| {
        let ray = camera.unproject(&Point2::new(x as f64, y as f64)).unwrap();
        pose.transform_point(&Point3::from(ray * depth))
    });
    let mut random = fastrand::Rng::with_seed(5);
    let mut normals = Image::filled(width, height, [f32::NAN; 3]);
    for (out, (_, normal)) in normals.pixels_mut().iter_mut().zip(seen.pixels()) {
        let mut axis = || noise * 1.732 * (2.0 * random.f64() - 1.0);
        if let Some(normal) = normal {
            let noisy = (normal + Vector3::new(axis(), axis(), axis())).normalize();
            *out = [noisy.x as f32, noisy.y as f32, noisy.z as f32];
        }
    }
    Seen {
        name,
        camera,
        base_from_camera: pose,
        normals,
        confidence: seen.map(|(_, normal)| if normal.is_some() { 0.95 } else { 0.0 }),
        edge_confidence: edges.as_image().map(|&edge| if edge != 0 { 0.8 } else { 0.0 }),
        edges,
        mask,
        depth,
    }
}

/// On the nearer side of a jump in depth, and along the rim of a level face beside which it goes down at once.
fn edges(seen: &Image<(f64, Option<Vector3<f64>>)>, point: &impl Fn(usize, usize, f64) -> Point3<f64>) -> Mask {
    let at = |x: i64, y: i64| {
        let at = (x >= 0 && y >= 0).then(|| seen.get(x as usize, y as usize)).flatten();
        at.map(|&(depth, normal)| (depth, normal.unwrap_or(Vector3::z())))
    };
    let height = |x: i64, y: i64| at(x, y).map(|(depth, _)| point(x as usize, y as usize, depth).z);
    let reach = (seen.width() / 100) as i64;
    let is_edge = |x: usize, y: usize| {
        let (x, y) = (x as i64, y as i64);
        let (own, normal) = at(x, y).unwrap();
        let jump = |dx: i64, dy: i64| {
            let (ahead, behind) = (at(x + dx, y + dy), at(x - dx, y - dy));
            // Slopes go on; jumps do not.
            ahead
                .zip(behind)
                .is_some_and(|((ahead, _), (behind, _))| ahead - own > STEP && ahead - 2.0 * own + behind > STEP)
        };
        let rim = |dx: i64, dy: i64| {
            let turns = at(x + dx, y + dy).is_some_and(|(_, next)| next.z < 0.9);
            let falls = height(x + reach * dx, y + reach * dy).zip(height(x, y));
            normal.z > 0.98 && turns && falls.is_some_and(|(there, here)| here - there > STEP)
        };
        [(1, 0), (-1, 0), (0, 1), (0, -1)]
            .into_iter()
            .any(|(dx, dy)| jump(dx, dy) || rim(dx, dy))
    };
    Mask::from_nonzero(&Image::from_fn(seen.width(), seen.height(), |x, y| {
        u8::from(is_edge(x, y))
    }))
}
