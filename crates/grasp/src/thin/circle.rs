//! The smallest circle around points.

use geometry::nalgebra::Point2;

/// Points this far outside, relative to the radius, count as inside.
const TOLERANCE: f64 = 1e-9;

/// A circle on the table's plane, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Circle {
    pub(crate) centre: Point2<f64>,
    pub(crate) radius: f64,
}

/// Smallest enclosing circle: a point outside of the circle so far lies on the next one (Welzl, "Smallest enclosing disks
/// (balls and ellipsoids)", LNCS 555, 1991), in loops instead of recursion; none without points.
pub(crate) fn smallest_circle(points: &[Point2<f64>]) -> Option<Circle> {
    let points = shuffled(points);
    let mut circle = Circle {
        centre: *points.first()?,
        radius: 0.0,
    };
    for (i, a) in points.iter().enumerate() {
        if circle.holds(a) {
            continue;
        }
        circle = Circle {
            centre: *a,
            radius: 0.0,
        };
        for (j, b) in points[..i].iter().enumerate() {
            if circle.holds(b) {
                continue;
            }
            circle = Circle::through_two(a, b);
            for c in &points[..j] {
                if !circle.holds(c) {
                    circle = Circle::through_three(a, b, c);
                }
            }
        }
    }
    Some(circle)
}

/// In an order that has nothing to do with theirs, the same every time: neighbours in a row would make the loops deep.
fn shuffled(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&index| (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    order.into_iter().map(|index| points[index]).collect()
}

impl Circle {
    fn holds(&self, point: &Point2<f64>) -> bool {
        (point - self.centre).norm() <= self.radius * (1.0 + TOLERANCE)
    }

    fn through_two(a: &Point2<f64>, b: &Point2<f64>) -> Self {
        Self {
            centre: geometry::nalgebra::center(a, b),
            radius: (a - b).norm() / 2.0,
        }
    }

    /// Of three points in a row the two farthest apart.
    fn through_three(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> Self {
        let (ab, ac) = (b - a, c - a);
        let doubled = 2.0 * ab.perp(&ac);
        if doubled.abs() < 1e-18 {
            let pairs = [(a, b), (a, c), (b, c)].map(|(p, q)| Self::through_two(p, q));
            return pairs.into_iter().fold(
                pairs[0],
                |best, next| if next.radius > best.radius { next } else { best },
            );
        }
        let (bb, cc) = (ab.norm_squared(), ac.norm_squared());
        let offset = geometry::nalgebra::Vector2::new(ac.y * bb - ab.y * cc, ab.x * cc - ac.x * bb) / doubled;
        Self {
            centre: a + offset,
            radius: offset.norm(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The smallest circle that holds all, among those through two or three of the points.
    fn by_search(points: &[Point2<f64>]) -> f64 {
        let mut best = f64::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for (j, b) in points.iter().enumerate().skip(i + 1) {
                let triples = points[j + 1..].iter().map(|c| Circle::through_three(a, b, c));
                for circle in triples.chain([Circle::through_two(a, b)]) {
                    let grown = Circle {
                        radius: circle.radius * (1.0 + 1e-7),
                        ..circle
                    };
                    if points.iter().all(|point| grown.holds(point)) {
                        best = best.min(circle.radius);
                    }
                }
            }
        }
        best
    }

    proptest! {
        #[test]
        fn it_is_the_smallest_of_all_that_hold_the_points(
            places in prop::collection::vec((-0.1_f64..0.1, -0.1_f64..0.1), 2..12)
        ) {
            let points: Vec<_> = places.iter().map(|&(x, y)| Point2::new(x, y)).collect();
            let circle = smallest_circle(&points).unwrap();
            for point in &points {
                prop_assert!((point - circle.centre).norm() <= circle.radius * (1.0 + 1e-6));
            }
            let best = by_search(&points);
            prop_assert!((circle.radius - best).abs() < 1e-6 * best, "{} instead of {best}", circle.radius);
        }
    }

    #[test]
    fn without_points_there_is_none() {
        assert_eq!(smallest_circle(&[]), None);
    }
}
