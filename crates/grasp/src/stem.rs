//! Whether anything stands in the way of the cup, its stem and the gripper.

use geometry::nalgebra::{Point3, Vector3};

use crate::cup::Cup;
use crate::view::View;

/// Points of a view's integrated depth, and the area each stands for.
#[derive(Debug)]
pub(crate) struct SurfacePoints {
    points: Vec<(Point3<f64>, f64)>,
}

impl SurfacePoints {
    /// One point for each coarse cell that has a depth.
    pub(crate) fn new(view: &View<'_>) -> Self {
        let blocks = &view.level.blocks;
        let [focal, _] = view.input.camera.focal();
        let point = |(index, cell): (usize, &crate::level::Cell)| {
            let depth = f64::from(cell.depth);
            if depth.is_nan() {
                return None;
            }
            let pixel = blocks.pixel((index % blocks.width) as f64, (index / blocks.width) as f64);
            let area = (depth * blocks.factor as f64 / focal).powi(2);
            Some((view.ray(&pixel)?.at(depth), area))
        };
        Self {
            points: blocks.cells.iter().enumerate().filter_map(point).collect(),
        }
    }

    /// Area, as the camera sees it, of what lies in the way, square metres. `lift` is how far this view's depth has the
    /// contact itself over its place; its other points are as wrong.
    pub(crate) fn in_the_way(
        &self,
        contact: &Point3<f64>,
        normal: &Vector3<f64>,
        lift: f64,
        cup: &Cup,
        margin: f64,
    ) -> f64 {
        let (lip, stem, body) = (cup.radius(), cup.stem_diameter / 2.0, cup.body_diameter / 2.0);
        let blocks = |point: &Point3<f64>| {
            let from = point - contact;
            let along = from.dot(normal) - lift;
            let aside = (from - normal * from.dot(normal)).norm();
            let is_beside_cup = along < lip && aside < lip;
            let is_beside_stem = along < cup.stem_length && aside < stem;
            let is_beside_body = along > cup.body_distance && aside < body;
            along > margin && (is_beside_cup || is_beside_stem || is_beside_body)
        };
        self.points
            .iter()
            .filter(|(point, _)| blocks(point))
            .map(|(_, area)| area)
            .sum()
    }
}
