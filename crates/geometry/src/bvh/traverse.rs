//! The way of a ray through the hierarchy, nearest boxes first.

use glam::Vec4;

use super::build::MAX_DEPTH;
use super::packet::TrianglePacket;
use super::{LEAF, NO_CHILD, TriangleBvh};
use crate::ray::Ray;

/// Every level leaves at most three siblings waiting.
const STACK: usize = 3 * MAX_DEPTH + 4;

/// A direction's component is at least this, so that its inverse is finite and no 0 · ∞ arises in a slab.
const SMALLEST: f32 = 1e-20;

/// A ray in single precision, relative to the mesh's middle; each number in all four lanes.
pub(super) struct Line {
    pub(super) origin: [Vec4; 3],
    pub(super) direction: [Vec4; 3],
    pub(super) inverse: [Vec4; 3],
    /// By axis, whether it goes towards smaller numbers.
    pub(super) backwards: [bool; 3],
}

impl Line {
    pub(super) fn new(ray: &Ray, centre: &[f64; 3]) -> Self {
        let direction: [f32; 3] = std::array::from_fn(|axis| ray.direction[axis] as f32);
        let inverse = direction.map(|d| 1.0 / if d.abs() < SMALLEST { SMALLEST.copysign(d) } else { d });
        Self {
            origin: std::array::from_fn(|axis| Vec4::splat((ray.origin[axis] - centre[axis]) as f32)),
            direction: direction.map(Vec4::splat),
            inverse: inverse.map(Vec4::splat),
            backwards: inverse.map(|inverse| inverse < 0.0),
        }
    }
}

/// Shows `visit` the packets along the line; what it returns is the new limit.
pub(super) fn walk(
    bvh: &TriangleBvh,
    line: &Line,
    mut limit: f32,
    mut visit: impl FnMut(&TrianglePacket, f32) -> Option<f32>,
) {
    if bvh.nodes.is_empty() {
        return;
    }
    let mut waiting = [(0_u32, 0.0_f32); STACK];
    let mut count = 1;
    while count > 0 {
        count -= 1;
        let (child, entry) = waiting[count];
        if entry >= limit {
            continue;
        }
        if child & LEAF != 0 {
            if let Some(nearer) = visit(&bvh.packets[(child ^ LEAF) as usize], limit) {
                limit = nearer;
            }
            continue;
        }
        let node = &bvh.nodes[child as usize];
        let entries = node.boxes.entries(line, limit);
        let first = count;
        for (&child, &entry) in node.children.iter().zip(&entries) {
            if entry < limit && child != NO_CHILD {
                waiting[count] = (child, entry);
                count += 1;
                sink(&mut waiting[first..count]);
            }
        }
    }
}

/// Puts the last of a farthest-first row into its place; the nearest ends up last and is taken first.
#[inline]
fn sink(row: &mut [(u32, f32)]) {
    let mut place = row.len() - 1;
    while place > 0 && row[place - 1].1 < row[place].1 {
        row.swap(place - 1, place);
        place -= 1;
    }
}
