//! Triangle meshes.

use nalgebra::Point3;

use crate::rigid_transform::RigidTransform;

/// A surface of triangles, metres. Seen from outside, a triangle's corners run counter-clockwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleMesh {
    /// Corners.
    pub vertices: Vec<Point3<f64>>,
    /// Three indices of `vertices` each.
    pub triangles: Vec<[u32; 3]>,
}

impl TriangleMesh {
    /// The same surface in another frame.
    #[must_use]
    pub fn transformed(&self, target_from_mesh: &RigidTransform) -> Self {
        Self {
            vertices: self
                .vertices
                .iter()
                .map(|v| target_from_mesh.transform_point(v))
                .collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }
}
