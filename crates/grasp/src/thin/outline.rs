//! Outlines of thin objects in one view: edge pixels laid out on the table's plane.

use std::collections::BTreeMap;

use geometry::nalgebra::{Point2, Point3};

use super::circle::{Circle, smallest_circle};
use super::hull::{area_and_centroid, convex_hull, depth_inside, sides, smallest_rectangle};
use crate::view::View;

/// Edge pixels in cells of this size that touch belong together, metres: gaps up to it are bridged.
const CELL: f64 = 0.0012;
/// A place of the outline has an edge when one is this near, metres.
const REACH: f64 = 0.0015;
/// Places of the outline that are asked.
const PLACES: usize = 90;
/// Share of its smallest circle, or rectangle, that an outline must fill to be taken for one.
const FILLS: f64 = 0.88;

/// A closed line of edges on the table's plane.
#[derive(Debug, Clone)]
pub(crate) struct Outline {
    /// Corners of its convex hull, metres.
    pub(crate) hull: Vec<Point2<f64>>,
    pub(crate) circle: Circle,
    /// Of the circle, the rectangle or the hull, whichever it is.
    pub(crate) middle: Point2<f64>,
    /// Of the hull, square metres.
    pub(crate) area: f64,
    /// Share of the hull's length on which there are edges.
    pub(crate) coverage: f64,
}

/// Every group of edges that spans an area, the largest first.
pub(crate) fn outlines(view: &View<'_>, height: f64) -> Vec<Outline> {
    let on_plane = |edge: &crate::view::EdgePixel| {
        let distance = (height - view.centre.z) / edge.ray.z;
        let point: Point3<f64> = view.centre + edge.ray * distance;
        (distance > 0.0 && distance < 10.0).then(|| point.xy())
    };
    let points: Vec<Point2<f64>> = view.edges.iter().filter_map(on_plane).collect();
    let mut found: Vec<Outline> = groups(&points)
        .iter()
        .filter_map(|group| Outline::around(group))
        .collect();
    found.sort_by(|a, b| b.area.total_cmp(&a.area));
    found
}

impl Outline {
    fn around(points: &[Point2<f64>]) -> Option<Self> {
        let hull = convex_hull(points);
        let (area, centroid) = area_and_centroid(&hull)?;
        let circle = smallest_circle(&hull)?;
        let (rectangle, rectangle_area) = smallest_rectangle(&hull)?;
        let middle = if area > FILLS * std::f64::consts::PI * circle.radius * circle.radius {
            circle.centre
        } else if area > FILLS * rectangle_area {
            rectangle
        } else {
            centroid
        };
        let coverage = coverage(&hull, points);
        Some(Self {
            hull,
            circle,
            middle,
            area,
            coverage,
        })
    }

    /// From the middle to the outline, metres.
    pub(crate) fn inner_radius(&self) -> f64 {
        depth_inside(&self.hull, &self.middle)
    }

    /// From the middle to the farthest corner, metres.
    pub(crate) fn outer_radius(&self) -> f64 {
        let distances = self.hull.iter().map(|corner| (corner - self.middle).norm());
        distances.fold(0.0, f64::max)
    }

    /// Another outline lies within.
    pub(crate) fn encloses(&self, other: &Self) -> bool {
        other.area < self.area && depth_inside(&self.hull, &other.middle) > 0.0
    }
}

/// Points in cells that touch, also by their corners.
fn groups(points: &[Point2<f64>]) -> Vec<Vec<Point2<f64>>> {
    let cell = |point: &Point2<f64>| ((point.x / CELL).floor() as i64, (point.y / CELL).floor() as i64);
    let mut cells: BTreeMap<(i64, i64), Vec<Point2<f64>>> = BTreeMap::new();
    for point in points {
        cells.entry(cell(point)).or_default().push(*point);
    }
    let mut found = Vec::new();
    while let Some((first, own)) = cells.pop_first() {
        let (mut group, mut open) = (own, vec![first]);
        while let Some((x, y)) = open.pop() {
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            for neighbour in around {
                if let Some(own) = cells.remove(&neighbour) {
                    group.extend(own);
                    open.push(neighbour);
                }
            }
        }
        found.push(group);
    }
    found
}

/// Share of places along a hull, at even distances, that have a point near.
fn coverage(hull: &[Point2<f64>], points: &[Point2<f64>]) -> f64 {
    let length: f64 = sides(hull).map(|(a, b)| (b - a).norm()).sum();
    let step = length / PLACES as f64;
    let (mut covered, mut asked, mut ahead) = (0_usize, 0_usize, step / 2.0);
    for (a, b) in sides(hull) {
        let side = (b - a).norm();
        while ahead < side && asked < PLACES {
            let place = a + (b - a) * (ahead / side);
            covered += usize::from(
                points
                    .iter()
                    .any(|point| (point - place).norm_squared() < REACH * REACH),
            );
            asked += 1;
            ahead += step;
        }
        ahead -= side;
    }
    covered as f64 / asked.max(1) as f64
}
