//! Flat things of the cell: table, mat, walls and panels.

use geometry::Ray;
use geometry::nalgebra::{Point3, Vector3};

use crate::scene::{Panel, Room, Wall};

/// A rectangle that reflects or shines on its front; its back is black.
#[derive(Debug, Clone)]
pub(super) struct Rectangle {
    pub(super) centre: Point3<f64>,
    pub(super) normal: Vector3<f64>,
    pub(super) right: Vector3<f64>,
    pub(super) up: Vector3<f64>,
    pub(super) half: [f64; 2],
    pub(super) albedo: f64,
    /// Which panel it is.
    pub(super) panel: Option<usize>,
}

impl Rectangle {
    fn new(centre: Point3<f64>, normal: Vector3<f64>, right: Vector3<f64>, size: [f64; 2], albedo: f64) -> Self {
        Self {
            centre,
            normal,
            right,
            up: normal.cross(&right),
            half: size.map(|side| side / 2.0),
            albedo,
            panel: None,
        }
    }

    fn level(centre: [f64; 2], size: [f64; 2], albedo: f64) -> Self {
        let centre = Point3::new(centre[0], centre[1], 0.0);
        Self::new(centre, Vector3::z(), Vector3::x(), size, albedo)
    }

    fn wall(wall: &Wall) -> Self {
        Self::new(
            wall.centre,
            wall.normal.into_inner(),
            wall.right.into_inner(),
            wall.size,
            wall.albedo,
        )
    }

    fn panel(index: usize, panel: &Panel) -> Self {
        let (facing, right) = (panel.facing.into_inner(), panel.right.into_inner());
        Self {
            panel: Some(index),
            ..Self::new(panel.centre, facing, right, panel.size, 0.0)
        }
    }

    /// The mat first: where it lies on the table, it is what is seen.
    pub(super) fn all(room: &Room, panels: &[Panel; 7]) -> Vec<Self> {
        let mat = Self::level(room.mat_centre, room.mat_size, room.mat_albedo);
        let table = Self::level(room.table_centre, room.table_size, room.table_albedo);
        let panels = panels
            .iter()
            .enumerate()
            .map(|(index, panel)| Self::panel(index, panel));
        [mat, table]
            .into_iter()
            .chain(room.walls.iter().map(Self::wall))
            .chain(panels)
            .collect()
    }

    /// Distance at which a ray meets it, from either side.
    pub(super) fn meet(&self, ray: &Ray) -> Option<f64> {
        let distance = (self.centre - ray.origin).dot(&self.normal) / ray.direction.dot(&self.normal);
        let inside = |[right, up]: [f64; 2]| right.abs() <= self.half[0] && up.abs() <= self.half[1];
        (distance > 0.0 && inside(self.coordinates(&ray.at(distance)))).then_some(distance)
    }

    /// Position on the rectangle, metres from its middle along `right` and `up`.
    pub(super) fn coordinates(&self, point: &Point3<f64>) -> [f64; 2] {
        let offset = point - self.centre;
        [offset.dot(&self.right), offset.dot(&self.up)]
    }

    /// The point at such a position.
    pub(super) fn at(&self, [right, up]: [f64; 2]) -> Point3<f64> {
        self.centre + self.right * right + self.up * up
    }

    /// Height above its front.
    pub(super) fn height(&self, point: &Point3<f64>) -> f64 {
        (point - self.centre).dot(&self.normal)
    }
}
