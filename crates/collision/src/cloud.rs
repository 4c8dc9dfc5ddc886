//! Clouds of points with a radius, in a tree that finds the nearest one to anything that can tell its distance.

use nalgebra::Point3;

use crate::error::{CollisionError, require_finite, require_length};
use crate::maths::{Vector, vector};
use crate::shape::Ball;

/// Points at a leaf, at most.
const LEAF: usize = 8;
/// Deeper than any tree: 8 × 2^40 points.
const MOST_PENDING: usize = 41;

/// Points in the base frame, each the middle of a small ball.
///
/// A balanced tree of halves along the longest side; every node knows a ball that holds its points. Nodes lie in one
/// list, children of node `i` at `2i + 1` and `2i + 2`, and the points of a node in one run.
#[derive(Debug, Clone)]
pub struct PointCloud {
    points: Vec<Vector>,
    nodes: Vec<Ball>,
    radius: f64,
}

/// A node that is still to be looked into.
#[derive(Clone, Copy, Default)]
struct Pending {
    node: usize,
    first: usize,
    end: usize,
    least: f64,
}

impl PointCloud {
    /// Points in metres in the base frame, all with one radius; no points at all are allowed.
    ///
    /// # Errors
    /// A point that is no number (points without a measurement must be left out), a radius that is not positive.
    pub fn new(points: &[Point3<f64>], radius: f64) -> Result<Self, CollisionError> {
        require_length("point cloud", "radius", radius)?;
        for (index, point) in points.iter().enumerate() {
            if point.iter().any(|value| !value.is_finite()) {
                require_finite(
                    &format!("point cloud, point {index}"),
                    "coordinate",
                    point.coords.as_slice(),
                )?;
            }
        }
        let mut cloud = Self {
            points: points.iter().map(vector).collect(),
            nodes: Vec::new(),
            radius,
        };
        cloud.build();
        Ok(cloud)
    }

    /// How many points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    fn build(&mut self) {
        if self.points.is_empty() {
            return;
        }
        let leaves = self.points.len().div_ceil(LEAF).next_power_of_two();
        let nothing = Ball {
            centre: Vector::ZERO,
            radius: 0.0,
        };
        self.nodes = vec![nothing; 2 * leaves - 1];
        fill(&mut self.nodes, 0, &mut self.points);
    }

    /// Least value of `distance` (signed, metres, to a point without radius) over all points less their radius, or
    /// `bound` if none is below that. It may change by no more than the way between two points, as distances do: so
    /// its value in the middle of a node bounds all in the node.
    pub(crate) fn nearest(&self, bound: f64, distance: impl Fn(Vector) -> f64) -> f64 {
        let mut best = bound + self.radius;
        let least = |node: usize| distance(self.nodes[node].centre) - self.nodes[node].radius;
        let mut stack = [Pending::default(); MOST_PENDING];
        let mut height = 0;
        if !self.is_empty() {
            let (node, first, end) = (0, 0, self.len());
            stack[0] = Pending {
                node,
                first,
                end,
                least: least(node),
            };
            height = 1;
        }
        while height > 0 {
            height -= 1;
            let Pending {
                node,
                first,
                end,
                least: at_least,
            } = stack[height];
            if at_least >= best {
                continue;
            }
            let left = 2 * node + 1;
            if left >= self.nodes.len() {
                best = self.points[first..end]
                    .iter()
                    .map(|&point| distance(point))
                    .fold(best, f64::min);
                continue;
            }
            let middle = first.midpoint(end);
            let [mut near, mut far] =
                [(left, first, middle), (left + 1, middle, end)].map(|(node, first, end)| Pending {
                    node,
                    first,
                    end,
                    least: least(node),
                });
            if far.least < near.least {
                (near, far) = (far, near);
            }
            stack[height] = far;
            stack[height + 1] = near;
            height += 2;
        }
        best - self.radius
    }
}

/// Sorts the points of a node into those of its children, down to the leaves.
fn fill(nodes: &mut [Ball], node: usize, points: &mut [Vector]) {
    let low = points.iter().copied().fold(Vector::INFINITY, Vector::min);
    let high = points.iter().copied().fold(Vector::NEG_INFINITY, Vector::max);
    let centre = if points.is_empty() {
        Vector::ZERO
    } else {
        0.5 * (low + high)
    };
    let reach = points.iter().map(|point| (*point - centre).length_squared());
    let radius = reach.fold(0.0, f64::max).sqrt();
    nodes[node] = Ball { centre, radius };
    if 2 * node + 1 >= nodes.len() {
        return;
    }
    let middle = points.len() / 2;
    let longest = (high - low).max_position();
    if middle < points.len() {
        points.select_nth_unstable_by(middle, |a, b| a[longest].total_cmp(&b[longest]));
    }
    let (left, right) = points.split_at_mut(middle);
    fill(nodes, 2 * node + 1, left);
    fill(nodes, 2 * node + 2, right);
}
