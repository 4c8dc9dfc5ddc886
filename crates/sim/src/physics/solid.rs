//! A rigid body, prepared for questions about what it touches.

use std::collections::HashMap;
use std::sync::OnceLock;

use geometry::nalgebra::{Point3, Vector3};
use geometry::{Ray, RigidTransform, TriangleBvh, TriangleMesh};

use super::rest::Stance;
use crate::SimError;

/// Of printed plastic, kg/m³.
const DENSITY: f64 = 1200.0;
/// Less is no volume, m³.
const NO_VOLUME: f64 = 1e-12;
/// From probe to probe along an edge, metres.
const STEP: f64 = 0.000_25;
/// Cosine of the angle between the faces of an edge that is a bend, not a fold: 5 degrees.
const SMOOTH: f64 = 0.996;

/// A body in a frame of its own, metres.
#[derive(Debug)]
pub(crate) struct Solid {
    mesh: TriangleMesh,
    bvh: TriangleBvh,
    centre_of_mass: Point3<f64>,
    mass: f64,
    /// Made when the first body falls near it.
    probes: OnceLock<Vec<Point3<f64>>>,
    /// Made when it comes to rest.
    stance: OnceLock<Stance>,
}

impl Solid {
    /// Of a mesh in the body's frame; it should be closed, or its mass is a guess.
    pub(crate) fn new(mesh: TriangleMesh) -> Result<Self, SimError> {
        let bvh = TriangleBvh::new(&mesh)?;
        let (volume, centre_of_mass) = volume(&mesh);
        Ok(Self {
            mesh,
            bvh,
            centre_of_mass,
            mass: DENSITY * volume,
            probes: OnceLock::new(),
            stance: OnceLock::new(),
        })
    }

    /// The surface.
    pub(crate) fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Kilograms, as if it were filled evenly with plastic.
    pub(crate) fn mass(&self) -> f64 {
        self.mass
    }

    pub(crate) fn centre_of_mass(&self) -> Point3<f64> {
        self.centre_of_mass
    }

    /// Along a ray in the base frame: how far, in multiples of its direction, it is to the surface.
    pub(crate) fn hit(&self, base_from_solid: &RigidTransform, ray: &Ray, limit: f64) -> Option<f64> {
        let solid_from_base = base_from_solid.inverse();
        let ray = Ray {
            origin: solid_from_base.transform_point(&ray.origin),
            direction: solid_from_base.transform_direction(&ray.direction),
        };
        Some(self.bvh.closest_hit(&ray, limit)?.distance)
    }

    /// Places that can touch another body first: corners, and points close to each other on sharp edges.
    pub(crate) fn probes(&self) -> &[Point3<f64>] {
        self.probes.get_or_init(|| probes(&self.mesh))
    }

    /// How it stands and falls over.
    pub(super) fn stance(&self) -> &Stance {
        let stance = || Stance::new(&self.mesh.vertices, &self.centre_of_mass);
        self.stance.get_or_init(stance)
    }
}

/// Of a closed mesh, m³ and metres: the sum of the tetrahedra from the first corner to its triangles. What encloses
/// nothing has the middle of its corners.
fn volume(mesh: &TriangleMesh) -> (f64, Point3<f64>) {
    let Some(origin) = mesh.vertices.first() else {
        return (0.0, Point3::origin());
    };
    let (mut sum, mut moment) = (0.0, Vector3::zeros());
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner - origin);
        let tetrahedron = a.dot(&b.cross(&c)) / 6.0;
        sum += tetrahedron;
        moment += (a + b + c) * (tetrahedron / 4.0);
    }
    if sum.abs() > NO_VOLUME {
        return (sum.abs(), origin + moment / sum);
    }
    let middle = mesh.vertices.iter().map(|vertex| vertex - origin).sum::<Vector3<f64>>();
    (sum.abs(), origin + middle / mesh.vertices.len() as f64)
}

fn probes(mesh: &TriangleMesh) -> Vec<Point3<f64>> {
    let mut probes = mesh.vertices.clone();
    for (a, b) in sharp_edges(mesh) {
        let way = b - a;
        let steps = (way.norm() / STEP).ceil() as u32;
        probes.extend((1..steps).map(|step| a + way * (f64::from(step) / f64::from(steps))));
    }
    probes
}

/// Edges of one triangle alone, and those between triangles that are not nearly in one plane.
fn sharp_edges(mesh: &TriangleMesh) -> Vec<(Point3<f64>, Point3<f64>)> {
    // Of its first triangle the normal; whether it is sharp.
    let mut edges: HashMap<[u32; 2], (Vector3<f64>, bool)> = HashMap::new();
    for (index, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(index);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector3::z);
        for side in 0..3 {
            let mut ends = [corners[side], corners[(side + 1) % 3]];
            ends.sort_unstable();
            let fold = |known: &mut (Vector3<f64>, bool)| known.1 = known.0.dot(&normal) < SMOOTH;
            edges.entry(ends).and_modify(fold).or_insert((normal, true));
        }
    }
    let sharp = edges.into_iter().filter(|(_, (_, is_sharp))| *is_sharp);
    let mut sharp: Vec<_> = sharp.map(|(ends, _)| ends).collect();
    sharp.sort_unstable();
    let ends = |ends: [u32; 2]| ends.map(|end| mesh.vertices[end as usize]);
    sharp.into_iter().map(ends).map(|[a, b]| (a, b)).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::objects::{Cuboid, Pyramid, Shape};

    fn solid(shape: &Shape) -> Solid {
        Solid::new(shape.mesh(Path::new("")).expect("a shape")).expect("a mesh")
    }

    #[test]
    fn masses_and_their_centres_are_those_of_the_textbook() {
        let block = solid(&Shape::Box(Cuboid {
            size: Some([0.1, 0.06, 0.04]),
        }));
        assert!((block.mass() - 1200.0 * 0.1 * 0.06 * 0.04).abs() < 1e-12);
        assert!((block.centre_of_mass() - Point3::new(0.0, 0.0, 0.02)).norm() < 1e-12);
        let pyramid = solid(&Shape::Pyramid(Pyramid {
            side: 0.1,
            height: 0.06,
        }));
        assert!((pyramid.mass() - 1200.0 * 0.1 * 0.1 * 0.06 / 3.0).abs() < 1e-12);
        assert!(
            (pyramid.centre_of_mass().z - 0.015).abs() < 1e-12,
            "a quarter of its height"
        );
    }

    #[test]
    fn probes_lie_on_the_twelve_edges_of_a_box_and_not_on_its_diagonals() {
        let block = solid(&Shape::Box(Cuboid {
            size: Some([0.01, 0.01, 0.01]),
        }));
        for probe in block.probes() {
            let on_faces = [
                probe.x.abs() - 0.005,
                probe.y.abs() - 0.005,
                (probe.z - 0.005).abs() - 0.005,
            ];
            let on_face = on_faces.iter().filter(|off| off.abs() < 1e-12).count();
            let is_middle_of_a_side = probe.x == 0.0 && probe.y == 0.0;
            assert!(on_face >= 2 || is_middle_of_a_side, "{probe}");
        }
        assert!(block.probes().len() > 12 * 39);
    }
}
