//! Four boxes and four triangles at a time, one to each lane of a vector.

use glam::{BVec4A, Vec4};

use super::traverse::Line;
use crate::ray::Hit;

/// How far outside a triangle, in barycentric weights, still counts as a hit: closes cracks between neighbours that
/// rounding would open.
const EDGE_TOLERANCE: f32 = 3e-5;

/// Exits of boxes are stretched by the rounding of the slabs, so that a box is never missed by a hair.
const STRETCH: f32 = 1.000_001;

/// Four boxes, axis by axis.
#[derive(Debug, Clone)]
pub(super) struct BoxPacket {
    pub(super) low: [Vec4; 3],
    pub(super) high: [Vec4; 3],
}

impl BoxPacket {
    /// Boxes that nothing hits.
    pub(super) const EMPTY: Self = Self {
        low: [Vec4::INFINITY; 3],
        high: [Vec4::NEG_INFINITY; 3],
    };

    /// Where the line enters each box; infinite for those it misses or enters beyond `limit`.
    #[inline]
    pub(super) fn entries(&self, line: &Line, limit: f32) -> [f32; 4] {
        let mut near = Vec4::ZERO;
        let mut far = Vec4::splat(limit);
        for axis in 0..3 {
            let (origin, inverse) = (line.origin[axis], line.inverse[axis]);
            let (first, second) = if line.backwards[axis] {
                (self.high[axis], self.low[axis])
            } else {
                (self.low[axis], self.high[axis])
            };
            near = ((first - origin) * inverse).max(near);
            far = ((second - origin) * inverse).min(far);
        }
        Vec4::select(near.cmple(far * STRETCH), near, Vec4::INFINITY).to_array()
    }
}

/// Four triangles: first corner, the two edges from it, and positions in the mesh. Unused lanes have edges of length 0,
/// which no ray hits.
#[derive(Debug, Clone)]
pub(super) struct TrianglePacket {
    pub(super) corner: [Vec4; 3],
    pub(super) edge_1: [Vec4; 3],
    pub(super) edge_2: [Vec4; 3],
    pub(super) triangle: [u32; 4],
}

/// Where a line meets the planes of four triangles.
struct Meeting {
    hit: BVec4A,
    distance: Vec4,
    weights: [Vec4; 2],
}

impl TrianglePacket {
    pub(super) const EMPTY: Self = Self {
        corner: [Vec4::ZERO; 3],
        edge_1: [Vec4::ZERO; 3],
        edge_2: [Vec4::ZERO; 3],
        triangle: [0; 4],
    };

    /// Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    #[inline]
    fn meet(&self, line: &Line, limit: f32) -> Meeting {
        let p = cross(&line.direction, &self.edge_2);
        let inverse = dot(&self.edge_1, &p).recip();
        let to_origin = [0, 1, 2].map(|axis| line.origin[axis] - self.corner[axis]);
        let u = dot(&to_origin, &p) * inverse;
        let q = cross(&to_origin, &self.edge_1);
        let v = dot(&line.direction, &q) * inverse;
        let distance = dot(&self.edge_2, &q) * inverse;
        // An edge of length 0 makes the distance NaN or infinite, which fails the test.
        let inside = u.min(v).min(Vec4::ONE - u - v).cmpge(Vec4::splat(-EDGE_TOLERANCE));
        let within = distance.cmpgt(Vec4::ZERO) & distance.cmplt(Vec4::splat(limit));
        Meeting {
            hit: inside & within,
            distance,
            weights: [u, v],
        }
    }

    /// The nearest hit before `limit`.
    #[inline]
    pub(super) fn closest(&self, line: &Line, limit: f32) -> Option<Hit> {
        let Meeting { hit, distance, weights } = self.meet(line, limit);
        if !hit.any() {
            return None;
        }
        let distances = Vec4::select(hit, distance, Vec4::INFINITY).to_array();
        let nearest = (1..4).fold(0, |a, b| if distances[b] < distances[a] { b } else { a });
        Some(Hit {
            distance: f64::from(distances[nearest]),
            triangle: self.triangle[nearest],
            barycentric: weights.map(|w| f64::from(w[nearest]).clamp(0.0, 1.0)),
        })
    }

    /// Whether any triangle is hit before `limit`.
    #[inline]
    pub(super) fn any(&self, line: &Line, limit: f32) -> bool {
        self.meet(line, limit).hit.any()
    }
}

#[inline]
fn dot(a: &[Vec4; 3], b: &[Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: &[Vec4; 3], b: &[Vec4; 3]) -> [Vec4; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
