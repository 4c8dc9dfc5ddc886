//! Four boxes and four triangles at a time, laid out so that the compiler uses vector instructions.

use super::traverse::Line;
use crate::ray::Hit;

/// How far outside a triangle, in barycentric weights, still counts as a hit: closes cracks between neighbours that
/// rounding would open.
const EDGE_TOLERANCE: f32 = 3e-5;

/// Four boxes, axis by axis.
#[derive(Debug, Clone)]
pub(super) struct BoxPacket {
    pub(super) low: [[f32; 4]; 3],
    pub(super) high: [[f32; 4]; 3],
}

impl BoxPacket {
    /// Boxes that nothing hits.
    pub(super) const EMPTY: Self = Self {
        low: [[f32::INFINITY; 4]; 3],
        high: [[f32::NEG_INFINITY; 4]; 3],
    };

    /// Where the line enters each box; infinite for those it misses or enters beyond `limit`.
    #[inline]
    pub(super) fn entries(&self, line: &Line, limit: f32) -> [f32; 4] {
        let mut near = [0.0_f32; 4];
        let mut far = [limit; 4];
        for axis in 0..3 {
            let (origin, inverse) = (line.origin[axis], line.inverse[axis]);
            let (first, second) = if inverse < 0.0 {
                (&self.high[axis], &self.low[axis])
            } else {
                (&self.low[axis], &self.high[axis])
            };
            for lane in 0..4 {
                let entry = (first[lane] - origin) * inverse;
                let exit = (second[lane] - origin) * inverse;
                near[lane] = if entry > near[lane] { entry } else { near[lane] };
                far[lane] = if exit < far[lane] { exit } else { far[lane] };
            }
        }
        std::array::from_fn(|lane| {
            // The exit is stretched by the rounding of the slabs, so that a box is never missed by a hair.
            if near[lane] <= far[lane] * 1.000_001 {
                near[lane]
            } else {
                f32::INFINITY
            }
        })
    }
}

/// Four triangles: first corner, the two edges from it, and positions in the mesh. Unused lanes have edges of length 0,
/// which no ray hits.
#[derive(Debug, Clone)]
pub(super) struct TrianglePacket {
    pub(super) corner: [[f32; 4]; 3],
    pub(super) edge_1: [[f32; 4]; 3],
    pub(super) edge_2: [[f32; 4]; 3],
    pub(super) triangle: [u32; 4],
}

impl TrianglePacket {
    pub(super) const EMPTY: Self = Self {
        corner: [[0.0; 4]; 3],
        edge_1: [[0.0; 4]; 3],
        edge_2: [[0.0; 4]; 3],
        triangle: [0; 4],
    };

    /// The nearest hit before `limit` (Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997).
    #[inline]
    pub(super) fn closest(&self, line: &Line, limit: f32) -> Option<Hit> {
        let mut distances = [f32::INFINITY; 4];
        let mut weights = [[0.0_f32; 2]; 4];
        for lane in 0..4 {
            let edge_1 = self.edge_1.map(|axis| axis[lane]);
            let edge_2 = self.edge_2.map(|axis| axis[lane]);
            let p = cross(line.direction, edge_2);
            let inverse = 1.0 / dot(edge_1, p);
            let to_origin: [f32; 3] = std::array::from_fn(|axis| line.origin[axis] - self.corner[axis][lane]);
            let u = dot(to_origin, p) * inverse;
            let q = cross(to_origin, edge_1);
            let v = dot(line.direction, q) * inverse;
            let distance = dot(edge_2, q) * inverse;
            // An edge of length 0 makes the distance NaN or infinite, which fails the test.
            let inside = u.min(v).min(1.0 - u - v) >= -EDGE_TOLERANCE;
            let hit = inside && distance > 0.0 && distance < limit;
            distances[lane] = if hit { distance } else { f32::INFINITY };
            weights[lane] = [u, v];
        }
        let nearest = (1..4).fold(0, |a, b| if distances[b] < distances[a] { b } else { a });
        (distances[nearest] < f32::INFINITY).then(|| Hit {
            distance: f64::from(distances[nearest]),
            triangle: self.triangle[nearest],
            barycentric: weights[nearest].map(|w| f64::from(w).clamp(0.0, 1.0)),
        })
    }
}

#[inline]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
