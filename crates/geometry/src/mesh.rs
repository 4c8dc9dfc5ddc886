//! Triangle meshes.

use nalgebra::Point3;

use crate::error::{GeometryError, require_finite};
use crate::rigid_transform::RigidTransform;

/// Positions of triangles must fit into 31 bits.
const MAX_TRIANGLES: usize = (1 << 31) - 1;

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

    /// Refuses triangles without their vertices and vertices that are nowhere.
    pub fn check(&self) -> Result<(), GeometryError> {
        let (vertices, triangles) = (self.vertices.len(), self.triangles.len());
        if triangles > MAX_TRIANGLES {
            let allowed = MAX_TRIANGLES;
            return Err(GeometryError::TooManyTriangles { triangles, allowed });
        }
        for vertex in &self.vertices {
            require_finite("vertex", vertex.coords.as_slice())?;
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&vertex| vertex as usize >= vertices) {
                return Err(GeometryError::VertexIndex {
                    triangle,
                    vertex,
                    vertices,
                });
            }
        }
        Ok(())
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }
}
