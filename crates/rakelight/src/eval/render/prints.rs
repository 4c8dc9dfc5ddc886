//! Printed objects: what each pixel reflects.
//!
//! A capture knows the print at the middles of pixels. Printed cells are square and even, so those middles tell each
//! cell's albedo, and the cells that a pixel covers tell the pixel's.

use std::collections::HashMap;

use ::sim::render::RenderedView;
use ::sim::scene::View;
use geometry::RigidTransform;
use geometry::nalgebra::{Point2, Point3, Vector2, Vector3};

use super::description::PRINT_ALBEDO;

/// Places in a pixel at which the print is looked up: this many, squared.
const PARTS: usize = 4;

/// The print of an object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Print {
    pub(super) base_from_object: RigidTransform,
    /// Side of a cell on the object's x-y plane, metres.
    pub(super) cell: f64,
}

/// A cell: its object's label, column and row.
type Cell = (u8, i64, i64);

struct Lookup<'a> {
    rendered: &'a RenderedView,
    view: &'a View,
    /// By label.
    prints: HashMap<u8, Print>,
}

/// How much more each pixel reflects than what was rendered; NaN where there is no telling, at outlines above all.
pub(super) fn factors(rendered: &RenderedView, view: &View, prints: HashMap<u8, Print>, albedo: &[f32]) -> Vec<f32> {
    let lookup = Lookup { rendered, view, prints };
    let cells = lookup.cells(albedo);
    (0..albedo.len())
        .map(|pixel| match rendered.labels.pixels()[pixel] {
            0 => 1.0,
            _ => lookup
                .albedo(pixel, &cells)
                .map_or(f32::NAN, |a| a / PRINT_ALBEDO as f32),
        })
        .collect()
}

impl Lookup<'_> {
    /// Albedo of every cell in which a pixel has its middle.
    fn cells(&self, albedo: &[f32]) -> HashMap<Cell, f32> {
        let all = (0..albedo.len()).filter(|&pixel| self.inside(pixel));
        all.filter_map(|pixel| Some((self.cell(pixel, [0.0; 2])?, albedo[pixel])))
            .collect()
    }

    fn albedo(&self, pixel: usize, cells: &HashMap<Cell, f32>) -> Option<f32> {
        if !self.inside(pixel) {
            return None;
        }
        let along = |i: usize| (i as f64 + 0.5) / PARTS as f64 - 0.5;
        let mut sum = 0.0;
        for part in 0..PARTS * PARTS {
            let offset = [along(part % PARTS), along(part / PARTS)];
            sum += cells.get(&self.cell(pixel, offset)?)?;
        }
        Some(sum / (PARTS * PARTS) as f32)
    }

    /// Whether a pixel's neighbours lie on the same object and face the same way.
    fn inside(&self, pixel: usize) -> bool {
        let (width, height) = (self.rendered.labels.width(), self.rendered.labels.height());
        let (x, y) = (pixel % width, pixel / width);
        let what = |x: usize, y: usize| {
            let index = y * width + x;
            (
                self.rendered.labels.pixels()[index],
                self.rendered.normals.pixels()[index],
            )
        };
        let mut neighbours = (0..9).map(|i| (x + i % 3, y + i / 3));
        let (label, normal) = what(x, y);
        neighbours.all(|(x, y)| {
            let within = x > 0 && y > 0 && x <= width && y <= height;
            within && {
                let (other, turned) = what(x - 1, y - 1);
                let cosine: f32 = normal.iter().zip(turned).map(|(a, b)| a * b).sum();
                other == label && cosine > 0.999
            }
        })
    }

    /// The cell at a place in a pixel; the surface is taken as flat within it.
    fn cell(&self, pixel: usize, offset: [f64; 2]) -> Option<Cell> {
        let width = self.rendered.labels.width();
        let label = self.rendered.labels.pixels()[pixel];
        let print = self.prints.get(&label)?;
        let middle = Point2::new((pixel % width) as f64, (pixel / width) as f64);
        let depth = f64::from(self.rendered.depth.pixels()[pixel]);
        let normal = Vector3::from(self.rendered.normals.pixels()[pixel].map(f64::from));
        let ray = |at: Point2<f64>| {
            let in_camera = self.view.camera.unproject(&at).ok()?;
            Some(self.view.base_from_camera.transform_direction(&in_camera))
        };
        let (here, there) = (ray(middle)? * depth, ray(middle + Vector2::from(offset))?);
        let reach = normal.dot(&here) / normal.dot(&there);
        let point = Point3::from(self.view.base_from_camera.translation() + there * reach);
        let local = print.base_from_object.inverse().transform_point(&point);
        let [column, row] = [local.x, local.y].map(|along| (along / print.cell).floor() as i64);
        Some((label, column, row))
    }
}
