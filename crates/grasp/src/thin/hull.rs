//! Convex hulls and the smallest rectangle around them.

use geometry::nalgebra::{Point2, Vector2};

/// Corners of the convex hull against the clock (Andrew's monotone chain, Information Processing Letters 9, 1979).
pub(crate) fn convex_hull(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull = half_hull(sorted.iter());
    hull.pop();
    hull.extend(half_hull(sorted.iter().rev()));
    hull.pop();
    hull
}

fn half_hull<'a>(points: impl Iterator<Item = &'a Point2<f64>>) -> Vec<Point2<f64>> {
    let mut hull: Vec<Point2<f64>> = Vec::new();
    for point in points {
        while let [.., a, b] = hull.as_slice() {
            if (b - a).perp(&(point - b)) > 0.0 {
                break;
            }
            hull.pop();
        }
        hull.push(*point);
    }
    hull
}

/// Sides of a polygon, each from one corner to the next.
pub(crate) fn sides(corners: &[Point2<f64>]) -> impl Iterator<Item = (Point2<f64>, Point2<f64>)> + '_ {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (*a, *b))
}

/// Area and centroid of a convex polygon against the clock; none where it has no area.
pub(crate) fn area_and_centroid(corners: &[Point2<f64>]) -> Option<(f64, Point2<f64>)> {
    let origin = *corners.first()?;
    let (mut doubled, mut moment) = (0.0, Vector2::zeros());
    for (a, b) in sides(corners) {
        let (a, b) = (a - origin, b - origin);
        let part = a.perp(&b);
        doubled += part;
        moment += (a + b) * part;
    }
    (doubled > 1e-12).then(|| (doubled / 2.0, origin + moment / (3.0 * doubled)))
}

/// Middle and area of the smallest rectangle around a convex polygon: one of its sides lies on a side of the polygon
/// (Freeman and Shapira, Communications of the ACM 18, 1975).
pub(crate) fn smallest_rectangle(corners: &[Point2<f64>]) -> Option<(Point2<f64>, f64)> {
    let around = |(a, b): (Point2<f64>, Point2<f64>)| {
        let along = (b - a).try_normalize(1e-12)?;
        let across = Vector2::new(-along.y, along.x);
        let extent = |axis: &Vector2<f64>| {
            let heights = corners.iter().map(|corner| corner.coords.dot(axis));
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                (low.min(at), high.max(at))
            })
        };
        let ((left, right), (bottom, top)) = (extent(&along), extent(&across));
        let middle = along * f64::midpoint(left, right) + across * f64::midpoint(bottom, top);
        Some((Point2::from(middle), (right - left) * (top - bottom)))
    };
    sides(corners).filter_map(around).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Distance of a point from the nearest side, negative outside a convex polygon against the clock.
pub(crate) fn depth_inside(corners: &[Point2<f64>], point: &Point2<f64>) -> f64 {
    let depth = |(a, b): (Point2<f64>, Point2<f64>)| (b - a).perp(&(point - a)) / (b - a).norm().max(1e-12);
    let depth = sides(corners).map(depth).fold(f64::INFINITY, f64::min);
    if depth.is_finite() { depth } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned_rectangle() -> Vec<Point2<f64>> {
        let (sin, cos) = 0.3_f64.sin_cos();
        let corner = |x: f64, y: f64| Point2::new(1.0 + x * cos - y * sin, 2.0 + x * sin + y * cos);
        let grid = (0..=8).flat_map(|i| (0..=4).map(move |j| (f64::from(i) - 4.0, f64::from(j) - 2.0)));
        grid.map(|(x, y)| corner(x, y)).collect()
    }

    #[test]
    fn a_turned_rectangle_is_found_again() {
        let hull = convex_hull(&turned_rectangle());
        let (middle, area) = smallest_rectangle(&hull).unwrap();
        assert!((middle - Point2::new(1.0, 2.0)).norm() < 1e-9, "{middle}");
        assert!((area - 32.0).abs() < 1e-9, "{area}");
        let (own, centroid) = area_and_centroid(&hull).unwrap();
        assert!(
            (own - 32.0).abs() < 1e-9 && (centroid - middle).norm() < 1e-9,
            "{own} {centroid}"
        );
        assert!((depth_inside(&hull, &middle) - 2.0).abs() < 1e-9);
        assert!(depth_inside(&hull, &Point2::new(9.0, 2.0)) < 0.0);
    }

    #[test]
    fn the_hull_holds_every_point_and_turns_left_everywhere() {
        let mut random = fastrand::Rng::with_seed(3);
        let points: Vec<_> = (0..200).map(|_| Point2::new(random.f64(), random.f64())).collect();
        let hull = convex_hull(&points);
        for (a, b) in sides(&hull) {
            assert!(points.iter().all(|point| (b - a).perp(&(point - a)) >= -1e-12));
        }
    }

    #[test]
    fn lines_and_points_have_no_area() {
        let line: Vec<_> = (0..5).map(|k| Point2::new(f64::from(k), f64::from(k))).collect();
        assert_eq!(area_and_centroid(&convex_hull(&line)), None);
        assert_eq!(area_and_centroid(&[]), None);
    }
}
