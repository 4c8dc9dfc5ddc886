//! Whether anything stands in the way of the cup, its stem and the gripper.

use geometry::nalgebra::{Point3, Vector3};

use crate::cup::Cup;
use crate::view::View;

/// Points of a view's integrated depth, and the area each stands for.
#[derive(Debug)]
pub(crate) struct SurfacePoints {
    points: Vec<SurfacePoint>,
}

#[derive(Debug)]
struct SurfacePoint {
    place: Point3<f64>,
    /// Square metres.
    area: f64,
    /// As the view's level counts.
    object: u16,
}

/// How far a view's depth has a contact over its place; the rest of the same object is as wrong, others are not.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Lift {
    /// As the view's level counts.
    pub(crate) object: u16,
    /// Metres.
    pub(crate) height: f64,
}

impl SurfacePoints {
    /// One point for each coarse cell that has a depth.
    pub(crate) fn new(view: &View<'_>) -> Self {
        let blocks = &view.level.blocks;
        let [focal, _] = view.input.camera.focal();
        let point = |index: usize| {
            let depth = view.depth_of(index)?;
            let pixel = blocks.pixel((index % blocks.width) as f64, (index / blocks.width) as f64);
            let area = (depth * blocks.factor as f64 / focal).powi(2);
            Some(SurfacePoint {
                place: view.ray(&pixel)?.at(depth),
                area,
                object: view.level.object_near(index),
            })
        };
        Self {
            points: (0..blocks.cells.len()).filter_map(point).collect(),
        }
    }

    /// Area, as the camera sees it, of what lies in the way, square metres.
    pub(crate) fn in_the_way(
        &self,
        contact: &Point3<f64>,
        normal: &Vector3<f64>,
        lift: Lift,
        cup: &Cup,
        margin: f64,
    ) -> f64 {
        let (lip, stem, body) = (cup.radius(), cup.stem_diameter / 2.0, cup.body_diameter / 2.0);
        let blocks = |point: &&SurfacePoint| {
            let from = point.place - contact;
            let own = if point.object == lift.object { lift.height } else { 0.0 };
            let along = from.dot(normal) - own;
            let aside = (from - normal * from.dot(normal)).norm();
            let is_beside_cup = along < lip && aside < lip;
            let is_beside_stem = along < cup.stem_length && aside < stem;
            let is_beside_body = along > cup.body_distance && aside < body;
            along > margin && (is_beside_cup || is_beside_stem || is_beside_body)
        };
        self.points.iter().filter(blocks).map(|point| point.area).sum()
    }
}
