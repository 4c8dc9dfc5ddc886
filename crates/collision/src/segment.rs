//! Distances of line segments, the cores of capsules: to points, to each other and to boxes. Metres.

use crate::maths::Vector;

/// Below this share of a segment's squared length two directions count as parallel.
const PARALLEL: f64 = 1e-12;

/// A segment this near to a box touches it: rounding can tell no better. Metres.
const TOUCH: f64 = 1e-9;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub(crate) from: Vector,
    pub(crate) to: Vector,
}

impl Segment {
    pub(crate) fn distance_to_point(&self, point: Vector) -> f64 {
        let (along, to_point) = (self.to - self.from, point - self.from);
        let length_squared = along.dot(along);
        let share = if length_squared > 0.0 {
            (to_point.dot(along) / length_squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (to_point - along * share).length()
    }

    /// Ericson, "Real-Time Collision Detection", 2005, section 5.1.9 with its names for the products.
    pub(crate) fn distance_to_segment(&self, other: &Self) -> f64 {
        let (along, across, between) = (self.to - self.from, other.to - other.from, self.from - other.from);
        let (long, wide) = (along.length_squared(), across.length_squared());
        if long <= f64::MIN_POSITIVE {
            return other.distance_to_point(self.from);
        }
        if wide <= f64::MIN_POSITIVE {
            return self.distance_to_point(other.from);
        }
        let (both, ahead, beside) = (along.dot(across), along.dot(between), across.dot(between));
        let determinant = long * wide - both * both;
        let mut share = 0.0;
        if determinant > PARALLEL * long * wide {
            share = ((both * beside - ahead * wide) / determinant).clamp(0.0, 1.0);
        }
        let mut share_across = (both * share + beside) / wide;
        if share_across < 0.0 {
            (share, share_across) = ((-ahead / long).clamp(0.0, 1.0), 0.0);
        } else if share_across > 1.0 {
            (share, share_across) = (((both - ahead) / long).clamp(0.0, 1.0), 1.0);
        }
        (between + along * share - across * share_across).length()
    }

    /// To a box around the origin; inside it the negative way out.
    pub(crate) fn signed_distance_to_box(&self, half: Vector) -> f64 {
        let outside = self.distance_to_box(half);
        if outside > TOUCH { outside } else { -self.way_out(half) }
    }

    /// The squared distance of a point on the way is convex and its slope piecewise linear, so Newton's method finds the
    /// piece with the minimum and then the minimum itself; the bracket keeps it on the way.
    fn distance_to_box(&self, half: Vector) -> f64 {
        let along = self.to - self.from;
        let beyond = |share: f64| {
            let point = self.from + along * share;
            point - point.clamp(-half, half)
        };
        let (mut low, mut high) = (0.0, 1.0);
        let (first, last) = (beyond(low), beyond(high));
        if first.dot(along) >= 0.0 {
            return first.length();
        }
        if last.dot(along) <= 0.0 {
            return last.length();
        }
        let mut share = 0.5;
        let mut nearest = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let excess = beyond(share);
            nearest = nearest.min(excess.length_squared());
            let slope = excess.dot(along);
            if slope == 0.0 {
                break;
            }
            *(if slope < 0.0 { &mut low } else { &mut high }) = share;
            let curvature: f64 = (0..3)
                .filter(|&axis| excess[axis] != 0.0)
                .map(|axis| along[axis].powi(2))
                .sum();
            let step = share - slope / curvature;
            let next = if step > low && step < high {
                step
            } else {
                0.5 * (low + high)
            };
            if (next - share).abs() <= 1e-15 {
                break;
            }
            share = next;
        }
        nearest.sqrt()
    }

    /// Shortest translation that takes the segment out of a box it touches: the smallest overlap over the axes that can
    /// separate them, the box's own and its edges' cross products with the segment (Ericson 2005, section 5.2.1).
    fn way_out(&self, half: Vector) -> f64 {
        let (centre, arm) = (0.5 * (self.from + self.to), 0.5 * (self.to - self.from));
        let along_axes = (half + arm.abs() - centre.abs()).min_element();
        let units = [Vector::X, Vector::Y, Vector::Z];
        let across = units.map(|unit| {
            let axis = unit.cross(arm);
            let length = axis.length();
            if length <= PARALLEL.sqrt() * arm.length() {
                return f64::INFINITY;
            }
            (half.dot(axis.abs()) - centre.dot(axis).abs()) / length
        });
        across.into_iter().fold(along_axes, f64::min).max(0.0)
    }
}

/// Six pieces at most, and halvings of the bracket between them.
const MOST_STEPS: usize = 60;
