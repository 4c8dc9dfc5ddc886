//! What normals say of the step from pixel to pixel.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::IntegrationInput;
use super::multigrid::Level;
use crate::window::bounds;

/// A normal that leans away from its pixel's ray further than this says nothing: cosine.
const LEAST_FACING: f32 = 0.05;
/// The least a pixel with a normal is trusted, so that no part falls off.
const LEAST_TRUST: f32 = 1e-3;

/// One pixel's normal, camera frame, ray, and how far it is trusted.
#[derive(Debug, Clone, Copy)]
struct Element {
    normal: Vec3,
    ray: Vec3,
    trust: f32,
}

/// The part of a view that holds the mask.
pub(super) struct Surface {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Where its first pixel is in the view.
    corner: [usize; 2],
    view_width: usize,
    elements: Vec<Element>,
    /// Width of a pixel's ray at depth 1.
    pixel: f32,
}

impl Surface {
    pub(super) fn new(input: &IntegrationInput<'_>) -> Self {
        let ([left, top], [width, height]) = bounds(input.mask).unwrap_or(([0, 0], [1, 1]));
        let view_width = input.view.camera.width();
        let rotation = input.view.rotation();
        let row = |r: usize| {
            Vec3::new(
                rotation[(0, r)] as f32,
                rotation[(1, r)] as f32,
                rotation[(2, r)] as f32,
            )
        };
        // Rows of the inverse rotation are the camera's axes in the base frame.
        let camera_from_base = Mat3::from_cols(row(0), row(1), row(2)).transpose();
        let element = |local: usize| {
            let index = (top + local / width) * view_width + left + local % width;
            let [x, y] = input.rays.ideal().pixels()[index];
            let normal = camera_from_base * Vec3::from_array(input.normals.pixels()[index]);
            let ray = Vec3::new(x, y, 1.0);
            let facing = -normal.dot(ray) / ray.length();
            let inside = input.mask.as_image().pixels()[index] != 0 && normal.is_finite() && ray.is_finite();
            let trust = if inside && facing > LEAST_FACING {
                input.confidence.pixels()[index].clamp(LEAST_TRUST, 1.0)
            } else if inside {
                LEAST_TRUST
            } else {
                0.0
            };
            Element { normal, ray, trust }
        };
        Self {
            width,
            height,
            corner: [left, top],
            view_width,
            elements: (0..width * height).into_par_iter().map(element).collect(),
            pixel: (1.0 / input.view.camera.focal()[0]) as f32,
        }
    }

    /// The pixel of the view.
    pub(super) fn in_view(&self, local: usize) -> usize {
        (self.corner[1] + local / self.width) * self.view_width + self.corner[0] + local % self.width
    }

    /// A level start.
    pub(super) fn flat(&self) -> Vec<f32> {
        vec![0.0; self.elements.len()]
    }

    /// Whether a pixel has a depth.
    pub(super) fn is_inside(&self, index: usize) -> bool {
        self.elements[index].trust > 0.0
    }

    /// The step of log depth from one pixel to another, as the normal of `of` says; none where it leans away.
    fn step(&self, of: usize, from: usize, to: usize) -> Option<f32> {
        let normal = self.elements[of].normal;
        let (here, there) = (-normal.dot(self.elements[from].ray), -normal.dot(self.elements[to].ray));
        (here > LEAST_FACING && there > LEAST_FACING).then(|| (here / there).ln())
    }

    /// Weights and steps of all links, given the present log depth. With a stiffness of 0 both sides count alike.
    pub(super) fn system(&self, log_depth: &[f32], stiffness: f32) -> Level {
        let mut level = Level::empty(self.width, self.height);
        let sharpness = stiffness / (self.pixel * self.pixel);
        let right = self.links(log_depth, sharpness, 1);
        let down = self.links(log_depth, sharpness, self.width);
        for (index, (&(weight, step), &(weight_down, step_down))) in right.iter().zip(&down).enumerate() {
            level.right[index] = weight;
            level.down[index] = weight_down;
            level.source[index] -= weight * step + weight_down * step_down;
            if weight > 0.0 {
                level.source[index + 1] += weight * step;
            }
            if weight_down > 0.0 {
                level.source[index + self.width] += weight_down * step_down;
            }
        }
        level.finish();
        level
    }

    /// Weight and step from each pixel to the one `stride` further.
    fn links(&self, log_depth: &[f32], sharpness: f32, stride: usize) -> Vec<(f32, f32)> {
        let link = |index: usize| {
            let next = index + stride;
            let beyond = next >= self.elements.len() || (stride == 1 && next.is_multiple_of(self.width));
            if beyond || !self.is_inside(index) || !self.is_inside(next) {
                return (0.0, 0.0);
            }
            let forward = self.side(log_depth, sharpness, index, next, index.checked_sub(stride));
            let after = (next + stride < self.elements.len()).then_some(next + stride);
            let backward = self.side(log_depth, sharpness, next, index, after);
            let own = self
                .step(index, index, next)
                .map(|step| (forward * self.elements[index].trust, step));
            let other = self
                .step(next, index, next)
                .map(|step| (backward * self.elements[next].trust, step));
            combine(own, other)
        };
        (0..self.elements.len())
            .into_par_iter()
            .with_min_len(4096)
            .map(link)
            .collect()
    }

    /// How much of a pixel's say goes to the side of `to` and not to the opposite one, by how far the present depth
    /// misses its normal on both sides.
    fn side(&self, log_depth: &[f32], sharpness: f32, of: usize, to: usize, opposite: Option<usize>) -> f32 {
        let miss = |to: usize| {
            let step = self.step(of, of, to)?;
            let scale = self.elements[of].normal.z;
            Some((scale * (log_depth[to] - log_depth[of] - step)).powi(2))
        };
        let opposite = opposite.filter(|&pixel| self.is_inside(pixel)).and_then(miss);
        match (miss(to), opposite) {
            (Some(here), Some(there)) => 1.0 / (1.0 + (sharpness * (here - there)).clamp(-30.0, 30.0).exp()),
            _ => 0.5,
        }
    }
}

/// Both pixels' say as one weight and one step; a link that nobody speaks for holds weakly and level.
fn combine(own: Option<(f32, f32)>, other: Option<(f32, f32)>) -> (f32, f32) {
    let (a, p) = own.unwrap_or((0.0, 0.0));
    let (b, q) = other.unwrap_or((0.0, 0.0));
    let weight = a + b;
    if weight > 0.0 {
        (weight.max(1e-6), (a * p + b * q) / weight)
    } else {
        (1e-6, 0.0)
    }
}
