//! What the lights' places mean in the image, in squares small enough that it is the same all over one.

use std::ops::Range;

use geometry::nalgebra::{Matrix3, Point3, Vector3};
use imaging::Mask;
use rayon::prelude::*;

use super::{EdgeInput, EdgeOptions};
use crate::light_rig::{LightRig, PanelModel};
use crate::view::View;

/// Side of a square, pixels: 18 mm of the mat at half the sensor's resolution, over which a panel's light changes by a
/// few per cent.
pub(super) const SQUARE: usize = 64;
/// Lights that stand steeper than this above the horizon throw no shadow to speak of; sine.
const STEEPEST: f64 = 0.8;
/// Two lights are opposed when the cosine between their ways along the table is below this.
const OPPOSED: f64 = -0.5;
/// Predictions with weights over this only repeat noise.
const LARGEST_WEIGHT: f64 = 6.0;
/// Shift between the pixels compared, pixels: more than a smoothed step is wide, at most half a square.
const SHIFTS_PX: (f64, f64) = (2.0, 32.0);

/// What one light means in one square.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SquareLight {
    /// Two ways to predict it from others; none where that cannot be done.
    pub(super) predictions: Option<[Prediction; 2]>,
    /// What a level matte patch shows under it, in units of what it shows under the steepest light.
    pub(super) level: f32,
    /// Standard deviation of a prediction minus the sample, in units of one sample's.
    pub(super) noise_gain: f32,
    /// From an edge to the pixel looked at on the side away from the light: columns and rows.
    pub(super) shift: [isize; 2],
}

/// A matte patch shows under a light `Σ weight · sample` over three others.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Prediction {
    /// Which lights, in the order of the rig; the steepest one first.
    pub(super) sources: [usize; 3],
    /// And how much of each.
    pub(super) weights: [f32; 3],
}

/// All lights in all squares.
pub(super) struct Grid {
    columns: usize,
    lights: usize,
    squares: Vec<SquareLight>,
    reach_px: f64,
}

impl Grid {
    pub(super) fn new(input: &EdgeInput<'_>, options: &EdgeOptions) -> Self {
        let panels = input.capture.rig.panels();
        let (width, height) = (input.capture.stack.width(), input.capture.stack.height());
        let columns = width.div_ceil(SQUARE);
        let middle = |index: usize, size: usize| (index * SQUARE + SQUARE / 2).min(size - 1);
        let square = |index: usize| {
            let (column, row) = (index % columns, index / columns);
            let is_wanted = input.mask.is_none_or(|mask| touches(mask, column, row));
            let surface = || surface(input, options, middle(column, width), middle(row, height));
            match is_wanted.then(surface).flatten() {
                Some(point) => lights_at(input.capture.view, panels, &point, options.reach),
                None => vec![SquareLight::default(); panels.len()],
            }
        };
        let count = columns * height.div_ceil(SQUARE);
        let squares: Vec<Vec<SquareLight>> = (0..count).into_par_iter().map(square).collect();
        let squares = squares.concat();
        let lengths = squares.iter().map(|light| shift_length(light.shift));
        Self {
            columns,
            lights: panels.len(),
            reach_px: lengths.fold(SHIFTS_PX.0, f64::max),
            squares,
        }
    }

    /// Number of lights of the rig.
    pub(super) fn light_count(&self) -> usize {
        self.lights
    }

    /// All lights in one square.
    pub(super) fn square(&self, column: usize, row: usize) -> &[SquareLight] {
        let start = (row * self.columns + column) * self.lights;
        &self.squares[start..start + self.lights]
    }

    /// Columns of squares from the first to the last in which some light can be predicted.
    pub(super) fn used_columns(&self, row: usize) -> Range<usize> {
        let is_used = |column: &usize| {
            self.square(*column, row)
                .iter()
                .any(|light| light.predictions.is_some())
        };
        let first = (0..self.columns).find(is_used).unwrap_or(0);
        let end = (first..self.columns).rfind(is_used).map_or(first, |last| last + 1);
        first..end
    }

    /// Channels of the lights that can be predicted somewhere.
    pub(super) fn lights(&self, rig: &LightRig) -> Vec<u8> {
        let is_predicted = |light: usize| {
            let mut squares = self.squares.chunks_exact(self.lights);
            squares.any(|square| square[light].predictions.is_some())
        };
        let channels = rig.channels().into_iter().enumerate();
        channels
            .filter_map(|(light, channel)| is_predicted(light).then_some(channel))
            .collect()
    }

    /// Steps are seen over twice the reach; regions of fewer pixels are edges shorter than they are wide.
    pub(super) fn least_pixels(&self) -> usize {
        (4.0 * self.reach_px * self.reach_px) as usize
    }

    /// Gaps in an edge shorter than the reach are the noise's; half of it from either end.
    pub(super) fn bridge(&self) -> usize {
        (self.reach_px / 2.0).round() as usize
    }
}

/// Whether the mask has pixels in a square or so near that steps reach them.
fn touches(mask: &Mask, column: usize, row: usize) -> bool {
    let image = mask.as_image();
    let margin = SHIFTS_PX.1 as usize;
    let range = |index: usize, size: usize| {
        let start = index * SQUARE;
        start.saturating_sub(margin)..(start + SQUARE + margin).min(size)
    };
    let (columns, mut rows) = (range(column, image.width()), range(row, image.height()));
    rows.any(|y| image.row(y)[columns.clone()].iter().fold(0, |any, &value| any | value) != 0)
}

fn shift_length(shift: [isize; 2]) -> f64 {
    (shift[0] as f64).hypot(shift[1] as f64)
}

/// The point a pixel shows: from the depth, or on the level plane.
fn surface(input: &EdgeInput<'_>, options: &EdgeOptions, x: usize, y: usize) -> Option<Point3<f64>> {
    let view = input.capture.view;
    let ideal = *input.capture.rays.ideal().get(x, y)?;
    let measured = input.depth.and_then(|depth| depth.get(x, y)).map(|&z| f64::from(z));
    let depth = measured
        .filter(|z| z.is_finite() && *z > 0.0)
        .unwrap_or_else(|| view.depth_of_plane(ideal, options.height));
    let point = view.point_at_depth(ideal, depth);
    point.iter().all(|number| number.is_finite()).then_some(point)
}

fn lights_at(view: &View, panels: &[PanelModel], point: &Point3<f64>, reach: f64) -> Vec<SquareLight> {
    let vectors: Vec<Vector3<f64>> = panels.iter().map(|panel| effective_vector(panel, point)).collect();
    let of_light = |light: usize| {
        let predictions = predictions(&vectors, light);
        let shift = shift(view, point, &panels[light].rectangle.centre, reach);
        let (Some(predictions), Some(shift)) = (predictions, shift) else {
            return SquareLight::default();
        };
        let norm = |prediction: &Prediction| prediction.weights.iter().map(|w| w * w).sum::<f32>();
        SquareLight {
            predictions: Some(predictions),
            level: (vectors[light].z / vectors[predictions[0].sources[0]].z) as f32,
            noise_gain: (1.0 + predictions.iter().map(norm).fold(0.0, f32::max)).sqrt(),
            shift,
        }
    };
    (0..panels.len()).map(of_light).collect()
}

/// The panel's light and the room's in one vector, exact for level patches.
fn effective_vector(panel: &PanelModel, point: &Point3<f64>) -> Vector3<f64> {
    panel.light_vector(point) + panel.bounce.linear + Vector3::z() * panel.bounce.constant
}

/// From the steepest light, the most opposed one and each of the two next most opposed: where a light is blocked, these
/// are the least likely to be blocked as well. Of two predictions the darker one holds, because a light that has gone
/// below a facet's horizon shows 0 where the other lights' sum needs a negative sample.
fn predictions(vectors: &[Vector3<f64>], light: usize) -> Option<[Prediction; 2]> {
    let unit = |index: usize| vectors[index].try_normalize(1e-12);
    let flat = |index: usize| vectors[index].xy().try_normalize(1e-12);
    if unit(light)?.z > STEEPEST {
        return None;
    }
    let away = flat(light)?;
    let others = (0..vectors.len()).filter(|&index| index != light);
    let rise = |index: &usize| unit(*index).map_or(-1.0, |unit| unit.z);
    let overhead = others.clone().max_by(|a, b| rise(a).total_cmp(&rise(b)))?;
    let along = |index: usize| flat(index).map_or(1.0, |flat| flat.dot(&away));
    let mut opposed: Vec<usize> = others.filter(|&index| index != overhead).collect();
    opposed.sort_by(|&a, &b| along(a).total_cmp(&along(b)));
    let &[first, second, third, ..] = opposed.as_slice() else {
        return None;
    };
    if along(first) > OPPOSED {
        return None;
    }
    let with = |side: usize| solve(vectors, [overhead, first, side], vectors[light]);
    let (one, other) = (with(second), with(third));
    Some([one.or(other)?, other.or(one)?])
}

fn solve(vectors: &[Vector3<f64>], sources: [usize; 3], target: Vector3<f64>) -> Option<Prediction> {
    let matrix = Matrix3::from_columns(&sources.map(|source| vectors[source]));
    let weights = matrix.lu().solve(&target)?;
    let is_usable = weights.iter().all(|weight| weight.abs() <= LARGEST_WEIGHT);
    is_usable.then_some(Prediction {
        sources,
        weights: [weights.x as f32, weights.y as f32, weights.z as f32],
    })
}

/// The reach away from the light along the table, in the image; none where the camera does not see it.
fn shift(view: &View, point: &Point3<f64>, light: &Point3<f64>, reach: f64) -> Option<[isize; 2]> {
    let away = (point - light).xy().try_normalize(1e-9)?.push(0.0) * reach;
    let camera_from_base = view.base_from_camera.inverse();
    let pixel = |point: Point3<f64>| view.camera.project(&camera_from_base.transform_point(&point));
    let step = (pixel(point + away)? - pixel(point - away)?) / 2.0;
    let length = step.norm();
    let scaled = step * (length.clamp(SHIFTS_PX.0, SHIFTS_PX.1) / length.max(1e-9));
    Some([scaled.x.round() as isize, scaled.y.round() as isize])
}
