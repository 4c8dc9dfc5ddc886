//! Ray casting against triangles.

mod build;
mod packet;
mod traverse;

use crate::error::GeometryError;
use crate::mesh::TriangleMesh;
use crate::ray::{Hit, Ray};

use packet::{BoxPacket, TrianglePacket};
use traverse::{Line, walk};

/// A child that is not there; its box is empty, so that no ray gets here.
const NO_CHILD: u32 = u32::MAX;
/// Marks a child as a leaf; the other bits say which packet.
const LEAF: u32 = 1 << 31;

/// A mesh prepared for ray casting: a bounding volume hierarchy with four children to a node.
///
/// It computes in single precision, relative to the middle of the mesh: positions of hits are right to about 1e-6 of the
/// distance between the ray's origin and the mesh. Rays that leave a surface start a little off it, or they meet the
/// surface itself. A triangle is hit from both sides.
///
/// ```
/// use geometry::{Ray, TriangleBvh, TriangleMesh, nalgebra::{Point3, Vector3}};
///
/// let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Point3::from).to_vec();
/// let bvh = TriangleBvh::new(&TriangleMesh { vertices, triangles: vec![[0, 1, 2]] })?;
///
/// let down = Ray { origin: Point3::new(0.25, 0.5, 2.0), direction: Vector3::new(0.0, 0.0, -1.0) };
/// let hit = bvh.closest_hit(&down, f64::INFINITY).expect("over the triangle");
/// assert_eq!((hit.distance, hit.triangle, hit.barycentric), (2.0, 0, [0.25, 0.5]));
/// assert!(!bvh.any_hit(&down, 1.9));
/// # Ok::<(), geometry::GeometryError>(())
/// ```
#[derive(Debug, Clone)]
pub struct TriangleBvh {
    /// Middle of the mesh, the origin of everything below.
    centre: [f64; 3],
    /// The root is the first; none for an empty mesh.
    nodes: Vec<Node>,
    packets: Vec<TrianglePacket>,
}

#[derive(Debug, Clone)]
struct Node {
    boxes: BoxPacket,
    children: [u32; 4],
}

impl TriangleBvh {
    /// Prepares a mesh; one without triangles is never hit.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, GeometryError> {
        mesh.check()?;
        Ok(build::build(mesh))
    }

    /// The first triangle on the ray that is nearer than `limit`.
    pub fn closest_hit(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        let line = Line::new(ray, &self.centre);
        let mut best = None;
        walk(self, &line, limit as f32, |packet, limit| {
            let hit = packet.closest(&line, limit)?;
            best = Some(hit);
            Some(hit.distance as f32)
        });
        best
    }

    /// Whether anything on the ray is nearer than `limit`; cheaper than the closest hit.
    pub fn any_hit(&self, ray: &Ray, limit: f64) -> bool {
        let line = Line::new(ray, &self.centre);
        let mut found = false;
        walk(self, &line, limit as f32, |packet, limit| {
            found = packet.any(&line, limit);
            // A limit of 0 ends the walk.
            found.then_some(0.0)
        });
        found
    }
}
