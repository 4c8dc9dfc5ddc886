//! The light of every panel at every pixel, from closed forms on a coarse lattice.
//!
//! A light vector changes by a thousandth over a few pixels, so the closed form is evaluated every [`SPACING`] pixels at
//! three heights over the table; between them it is bilinear in the image and quadratic in the height.

use geometry::nalgebra::{Point3, Vector3};
use glam::Vec3;
use rayon::prelude::*;

use super::candidates::{Triple, triples};
use super::lanes::{Lanes, VectorLanes};
use crate::light_rig::PanelModel;
use crate::solution::Capture;

/// Pixels between lattice nodes.
const SPACING: usize = 32;
/// Heights of the lattice's levels over the table, metres; objects are up to 0.2 m high.
const LEVELS: [f64; 3] = [0.0, 0.08, 0.16];

/// All panels' light at a pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LightAt {
    /// Direct irradiance is this times the normal while the whole panel is above the horizon.
    pub(crate) vector: VectorLanes,
    /// Half the panels' sides as seen from here, in units of `vector`: how far the irradiance spreads about its middle.
    pub(crate) along: VectorLanes,
    /// Across `along`.
    pub(crate) across: VectorLanes,
}

/// All panels over the image.
pub(crate) struct LightField {
    columns: usize,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Default)]
struct Node {
    levels: [VectorLanes; 3],
    along: VectorLanes,
    across: VectorLanes,
    /// Hypotheses that hold about here, at the usual height.
    triples: Vec<Triple>,
}

impl LightAt {
    /// Irradiance of a unit normal, clipped at the horizon, and the share of the panel that is above it. The panel's
    /// directions are taken as spread evenly about their middle `m` by `a`, so that the part above the horizon gives
    /// `(m + a)² / 4a`; exact far from the horizon, and within 1 % of the facing irradiance at it.
    #[inline]
    pub(crate) fn irradiance(&self, normal: Vec3) -> (Lanes, Lanes) {
        let middle = self.vector.dot(normal);
        let (p, q) = (self.along.dot(normal), self.across.dot(normal));
        let reach = (p * p + q * q).sqrt() + Lanes::splat(1e-9);
        let share = (middle + reach) / (reach + reach);
        let share = share.fast_max(Lanes::ZERO).fast_min(Lanes::ONE);
        // Where the whole panel is above the horizon the middle is the larger one, else the clipped form.
        (middle.fast_max(share * share * reach), share)
    }
}

impl LightField {
    pub(crate) fn new(capture: &Capture<'_>) -> Self {
        let (width, height) = (capture.stack.width(), capture.stack.height());
        let (columns, rows) = (width.div_ceil(SPACING) + 1, height.div_ceil(SPACING) + 1);
        let node = |node: usize| {
            // Nodes beyond the image's end stand at its last pixel; the error is a fraction of a spacing.
            let x = (node % columns * SPACING).min(width - 1);
            let y = (node / columns * SPACING).min(height - 1);
            Node::new(capture, capture.rays.ideal().pixels()[y * width + x])
        };
        Self {
            columns,
            nodes: (0..columns * rows).into_par_iter().map(node).collect(),
        }
    }

    /// Hypotheses for the pixels about here: lights change too little from node to node to matter for a start.
    pub(crate) fn triples(&self, x: usize, y: usize) -> &[Triple] {
        &self.nodes[y / SPACING * self.columns + x / SPACING].triples
    }

    /// The panels' light at a pixel whose surface is `height` over the table, metres.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize, height: f32) -> LightAt {
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
        let first = y / SPACING * self.columns + x / SPACING;
        let corners = [first, first + 1, first + self.columns, first + self.columns + 1];
        let mut vector = VectorLanes::default();
        for (corner, weight) in corners.iter().zip(weights) {
            for (level, share) in self.nodes[*corner].levels.iter().zip(lagrange(height)) {
                vector.add_scaled(level, weight * share);
            }
        }
        LightAt {
            vector,
            along: self.nodes[first].along,
            across: self.nodes[first].across,
        }
    }
}

/// Weights of the three levels at a height.
#[inline]
fn lagrange(height: f32) -> [f32; 3] {
    let step = LEVELS[1] as f32;
    let t = (height / step).clamp(-0.5, 2.5);
    [(t - 1.0) * (t - 2.0) / 2.0, t * (2.0 - t), t * (t - 1.0) / 2.0]
}

impl Node {
    fn new(capture: &Capture<'_>, ideal: [f32; 2]) -> Self {
        let point = |height: f64| -> Point3<f64> {
            let depth = capture.view.depth_of_plane(ideal, height);
            capture.view.point_at_depth(ideal, depth)
        };
        let mut node = Self::default();
        for (lane, panel) in capture.rig.panels().iter().enumerate() {
            for (level, height) in node.levels.iter_mut().zip(LEVELS) {
                level.set(lane, to_glam(&panel.light_vector(&point(height))));
            }
            let [along, across] = half_sides(panel, &point(LEVELS[0] * 0.8 + LEVELS[1] * 0.2));
            node.along.set(lane, along);
            node.across.set(lane, across);
        }
        node.triples = triples(&node.levels[0], capture.rig.panels().len());
        node
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
