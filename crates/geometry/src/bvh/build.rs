//! Construction: binary splits by the surface area heuristic (Wald, "On fast construction of SAH-based bounding volume
//! hierarchies", 2007), two levels at a time.

use super::packet::{BoxPacket, TrianglePacket};
use super::{LEAF, NO_CHILD, Node, TriangleBvh};
use crate::mesh::TriangleMesh;

/// Candidate planes along the longest axis.
const BINS: usize = 16;
/// Below this many levels of nodes, ranges are halved, so that no mesh makes the tree deeper than its bound.
const SAH_DEPTH: usize = 24;
/// Levels of nodes there can be: halving twice per level divides 2^32 triangles in 16 more.
pub(super) const MAX_DEPTH: usize = SAH_DEPTH + 16;

#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    const EMPTY: Self = Self {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    fn join(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| self.low[axis].min(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].max(other.high[axis])),
        }
    }

    fn with_point(&self, point: [f32; 3]) -> Self {
        self.join(&Self {
            low: point,
            high: point,
        })
    }

    fn area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|axis| (self.high[axis] - self.low[axis]).max(0.0));
        x * y + y * z + z * x
    }
}

#[derive(Debug, Clone, Copy)]
struct Item {
    triangle: u32,
    bounds: Bounds,
    centroid: [f32; 3],
}

struct Builder<'a> {
    mesh: &'a TriangleMesh,
    bvh: TriangleBvh,
}

pub(super) fn build(mesh: &TriangleMesh) -> TriangleBvh {
    let centre = middle(mesh);
    let mut items: Vec<Item> = (0..mesh.triangles.len()).map(|t| item(mesh, t, &centre)).collect();
    let bvh = TriangleBvh {
        centre,
        nodes: Vec::new(),
        packets: Vec::new(),
    };
    let mut builder = Builder { mesh, bvh };
    if !items.is_empty() {
        builder.node(&mut items, 0);
    }
    builder.bvh
}

fn middle(mesh: &TriangleMesh) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let along = mesh.vertices.iter().map(|vertex| vertex[axis]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        if low <= high { low.midpoint(high) } else { 0.0 }
    })
}

fn item(mesh: &TriangleMesh, triangle: usize, centre: &[f64; 3]) -> Item {
    let corners = mesh
        .corners(triangle)
        .map(|corner| std::array::from_fn(|axis| (corner[axis] - centre[axis]) as f32));
    let bounds = corners.iter().fold(Bounds::EMPTY, |bounds, &c| bounds.with_point(c));
    Item {
        triangle: triangle as u32,
        bounds,
        centroid: std::array::from_fn(|axis| bounds.low[axis].midpoint(bounds.high[axis])),
    }
}

impl Builder<'_> {
    /// Adds a node over the items and everything below it.
    fn node(&mut self, items: &mut [Item], depth: usize) -> u32 {
        let index = self.bvh.nodes.len() as u32;
        self.bvh.nodes.push(Node {
            boxes: BoxPacket::EMPTY,
            children: [NO_CHILD; 4],
        });
        for (lane, part) in quarters(items, depth).into_iter().enumerate() {
            if part.is_empty() {
                continue;
            }
            let bounds = part.iter().fold(Bounds::EMPTY, |all, item| all.join(&item.bounds));
            let child = if part.len() <= 4 {
                self.leaf(part)
            } else {
                self.node(part, depth + 1)
            };
            let node = &mut self.bvh.nodes[index as usize];
            node.children[lane] = child;
            for axis in 0..3 {
                node.boxes.low[axis][lane] = bounds.low[axis];
                node.boxes.high[axis][lane] = bounds.high[axis];
            }
        }
        index
    }

    fn leaf(&mut self, items: &[Item]) -> u32 {
        let mut packet = TrianglePacket::EMPTY;
        for (lane, item) in items.iter().enumerate() {
            let corners = self.mesh.corners(item.triangle as usize);
            packet.triangle[lane] = item.triangle;
            for axis in 0..3 {
                let [a, b, c] = corners.map(|corner| (corner[axis] - self.bvh.centre[axis]) as f32);
                packet.corner[axis][lane] = a;
                packet.edge_1[axis][lane] = b - a;
                packet.edge_2[axis][lane] = c - a;
            }
        }
        self.bvh.packets.push(packet);
        LEAF | (self.bvh.packets.len() - 1) as u32
    }
}

fn quarters(items: &mut [Item], depth: usize) -> [&mut [Item]; 4] {
    let (left, right) = halves(items, depth);
    let ((a, b), (c, d)) = (halves(left, depth), halves(right, depth));
    [a, b, c, d]
}

/// Two parts, of which the second is empty when all fit into one leaf.
fn halves(items: &mut [Item], depth: usize) -> (&mut [Item], &mut [Item]) {
    if items.len() <= 4 {
        return items.split_at_mut(items.len());
    }
    let plane = if depth < SAH_DEPTH { best_plane(items) } else { None };
    let count = plane.map_or(0, |plane| partition(items, plane));
    if count > 0 && count < items.len() {
        return items.split_at_mut(count);
    }
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| a.centroid[0].total_cmp(&b.centroid[0]));
    items.split_at_mut(middle)
}

/// A plane across an axis.
#[derive(Clone, Copy)]
struct Plane {
    axis: usize,
    at: f32,
}

/// Moves what lies before the plane to the front and says how much that is.
fn partition(items: &mut [Item], plane: Plane) -> usize {
    let mut count = 0;
    for index in 0..items.len() {
        if items[index].centroid[plane.axis] < plane.at {
            items.swap(index, count);
            count += 1;
        }
    }
    count
}

/// The cheapest of the planes between the bins; none when all centroids coincide.
fn best_plane(items: &[Item]) -> Option<Plane> {
    let range = items
        .iter()
        .fold(Bounds::EMPTY, |all, item| all.with_point(item.centroid));
    let extent = |axis: usize| range.high[axis] - range.low[axis];
    let axis = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b)))?;
    let (low, width) = (range.low[axis], extent(axis) / BINS as f32);
    if width <= 0.0 {
        return None;
    }
    let mut bins = [(Bounds::EMPTY, 0_usize); BINS];
    for item in items {
        let bin = (((item.centroid[axis] - low) / width) as usize).min(BINS - 1);
        bins[bin] = (bins[bin].0.join(&item.bounds), bins[bin].1 + 1);
    }
    let mut reversed = bins;
    reversed.reverse();
    let (before, after) = (costs(&bins), costs(&reversed));
    let best = (1..BINS).min_by(|&a, &b| {
        let cost = |split: usize| before[split - 1] + after[BINS - split - 1];
        cost(a).total_cmp(&cost(b))
    })?;
    Some(Plane {
        axis,
        at: low + width * best as f32,
    })
}

/// Area times number of the first one, two, three, ... bins.
fn costs(bins: &[(Bounds, usize); BINS]) -> [f32; BINS] {
    let mut all = (Bounds::EMPTY, 0);
    bins.map(|(bounds, count)| {
        all = (all.0.join(&bounds), all.1 + count);
        // An empty box has an area of 0, not of infinity.
        if all.1 == 0 { 0.0 } else { all.0.area() * all.1 as f32 }
    })
}
