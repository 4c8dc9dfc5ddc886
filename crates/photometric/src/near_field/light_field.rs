//! The light of every panel at every pixel, from closed forms on a coarse lattice.
//!
//! A light vector changes by a thousandth over a few pixels, so the closed form is evaluated every [`SPACING`] pixels at
//! three heights over the table; between them it is bilinear in the image and quadratic in the height.

use geometry::nalgebra::{Point3, Vector3};
use glam::Vec3;
use rayon::prelude::*;

use crate::light_rig::PanelModel;
use crate::solution::Capture;

/// Pixels between lattice nodes.
const SPACING: usize = 32;
/// Heights of the lattice's levels over the table, metres; objects are up to 0.2 m high.
const LEVELS: [f64; 3] = [0.0, 0.08, 0.16];
/// Panels that a solver of this module can take; one bit each.
pub(crate) const MAX_PANELS: usize = 8;

/// One panel's light at a pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LightAt {
    /// Direct irradiance is this times the normal while the whole panel is above the horizon.
    pub(crate) vector: Vec3,
    /// Half the panel's sides as seen from here, in units of `vector`: how far the irradiance spreads about its middle.
    pub(crate) spread: [Vec3; 2],
}

/// All panels over the image.
pub(crate) struct LightField {
    columns: usize,
    /// Node by node, panel by panel.
    nodes: Vec<Node>,
    panels: usize,
}

#[derive(Debug, Clone, Copy, Default)]
struct Node {
    levels: [Vec3; 3],
    spread: [Vec3; 2],
}

impl LightAt {
    /// Irradiance of a unit normal, clipped at the horizon. The panel's directions are taken as spread evenly about
    /// their middle `m` by `a`, so that the part above the horizon gives `(m + a)² / 4a`; exact far from the horizon,
    /// and within 1 % of the facing irradiance at it.
    #[inline]
    pub(crate) fn irradiance(&self, normal: Vec3) -> f32 {
        let (middle, reach) = self.middle_and_reach(normal);
        clipped(middle, reach)
    }

    /// Irradiance, and its gradient by the normal.
    #[inline]
    pub(crate) fn gradient(&self, normal: Vec3) -> (f32, Vec3) {
        let (middle, reach) = self.middle_and_reach(normal);
        let share = ((middle + reach) / (2.0 * reach)).clamp(0.0, 1.0);
        (clipped(middle, reach), self.vector * share)
    }

    #[inline]
    fn middle_and_reach(&self, normal: Vec3) -> (f32, f32) {
        let (p, q) = (normal.dot(self.spread[0]), normal.dot(self.spread[1]));
        (normal.dot(self.vector), (p * p + q * q).sqrt() + 1e-9)
    }
}

#[inline]
fn clipped(middle: f32, reach: f32) -> f32 {
    let above = (middle + reach).max(0.0);
    if middle >= reach {
        middle
    } else {
        above * above / (4.0 * reach)
    }
}

impl LightField {
    pub(crate) fn new(capture: &Capture<'_>) -> Self {
        let (width, height) = (capture.stack.width(), capture.stack.height());
        let (columns, rows) = (width.div_ceil(SPACING) + 1, height.div_ceil(SPACING) + 1);
        let panels = capture.rig.panels();
        let nodes = (0..columns * rows)
            .into_par_iter()
            .flat_map_iter(|node| {
                let x = (node % columns * SPACING).min(width - 1);
                let y = (node / columns * SPACING).min(height - 1);
                // Nodes beyond the image's end stand at its last pixel; the error is a fraction of a spacing.
                let ideal = capture.rays.ideal().pixels()[y * width + x];
                panels.iter().map(move |panel| Node::new(capture, ideal, panel))
            })
            .collect();
        Self {
            columns,
            nodes,
            panels: panels.len(),
        }
    }

    /// The panels' light at a pixel whose surface is `height` over the table, metres.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize, height: f32, lights: &mut [LightAt; MAX_PANELS]) {
        let (column, row) = (x / SPACING, y / SPACING);
        let (right, down) = (
            (x % SPACING) as f32 / SPACING as f32,
            (y % SPACING) as f32 / SPACING as f32,
        );
        let weights = [
            (1.0 - right) * (1.0 - down),
            right * (1.0 - down),
            (1.0 - right) * down,
            right * down,
        ];
        let first = (row * self.columns + column) * self.panels;
        let below = first + self.columns * self.panels;
        let corners = [first, first + self.panels, below, below + self.panels];
        let level = lagrange(height);
        for (panel, light) in lights.iter_mut().enumerate().take(self.panels) {
            let mut vector = Vec3::ZERO;
            for (corner, weight) in corners.iter().zip(weights) {
                let node = &self.nodes[corner + panel];
                let at_height = node.levels[0] * level[0] + node.levels[1] * level[1] + node.levels[2] * level[2];
                vector += at_height * weight;
            }
            *light = LightAt {
                vector,
                spread: self.nodes[first + panel].spread,
            };
        }
    }
}

/// Weights of the three levels at a height.
fn lagrange(height: f32) -> [f32; 3] {
    let step = LEVELS[1] as f32;
    let t = (height / step).clamp(-0.5, 2.5);
    [(t - 1.0) * (t - 2.0) / 2.0, t * (2.0 - t), t * (t - 1.0) / 2.0]
}

impl Node {
    fn new(capture: &Capture<'_>, ideal: [f32; 2], panel: &PanelModel) -> Self {
        let point = |height: f64| -> Point3<f64> {
            capture
                .view
                .point_at_depth(ideal, capture.view.depth_of_plane(ideal, height))
        };
        let levels = LEVELS.map(|height| to_glam(&panel.light_vector(&point(height))));
        let middle = point(LEVELS[0] * 0.8 + LEVELS[1] * 0.2);
        let spread = half_sides(panel, &middle);
        Self { levels, spread }
    }
}

/// Half the panel's sides across the line of sight, over its distance, times the light's strength.
fn half_sides(panel: &PanelModel, point: &Point3<f64>) -> [Vec3; 2] {
    let rectangle = &panel.rectangle;
    let to_panel = rectangle.centre - point;
    let distance = to_panel.norm();
    let towards = to_panel / distance;
    let strength = panel.light_vector(point).norm();
    let up = rectangle.facing.cross(&rectangle.right);
    let side = |along: Vector3<f64>, length: f64| {
        let across = along - towards * towards.dot(&along);
        to_glam(&(across * (length / 2.0 / distance * strength)))
    };
    [
        side(rectangle.right.into_inner(), rectangle.size[0]),
        side(up, rectangle.size[1]),
    ]
}

pub(crate) fn to_glam(vector: &Vector3<f64>) -> Vec3 {
    Vec3::new(vector.x as f32, vector.y as f32, vector.z as f32)
}
