//! The solver as a whole.

use glam::Vec3;
use imaging::{Image, Mask};
use rayon::prelude::*;

use super::candidates::{Triple, directions, triples};
use super::coupling::{neighbours, smooth};
use super::gain::{self, Gain};
use super::pixel::{Estimate, Pixel};
use super::samples::Samples;
use crate::error::PhotometricError;
use crate::solution::{Capture, NormalSolution};

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearFieldOptions {
    /// How firmly neighbours hold together, as an inverse variance of their difference: 1 over 2 degrees squared.
    pub coupling: f32,
    /// Rounds of coupling and renewed fits.
    pub rounds: usize,
}

impl Default for NearFieldOptions {
    fn default() -> Self {
        Self {
            coupling: 800.0,
            rounds: 1,
        }
    }
}

/// Directions tried at pixels that no three lights explain.
const DIRECTIONS: usize = 100;
/// A pixel is explained when its cost is below this.
const EXPLAINED: f32 = 16.0;
/// Pixels between those that are fitted with all hypotheses.
const SPARSE: usize = 4;
/// A neighbour's normal is as good here as there when it costs no more than this beyond: less than a shadow.
const AS_WELL: f32 = 4.0;
/// Smoothing steps in a round.
const STEPS: usize = 6;

/// Normals of the pixels of a mask, under panels near the work. `depth` (metres along the optical axis) says where the
/// surface is, if it is known.
///
/// # Errors
/// A panel without an image, a mask or depth of another size, more panels than the solver takes.
pub fn near_field_normals(
    capture: &Capture<'_>,
    mask: &Mask,
    depth: Option<&Image<f32>>,
    options: &NearFieldOptions,
) -> Result<NormalSolution, PhotometricError> {
    let samples = Samples::new(capture, depth)?;
    let pixels = mask.as_image().pixels();
    let inside: Vec<u32> = (0..pixels.len() as u32)
        .filter(|&index| pixels[index as usize] != 0)
        .collect();
    let Some(gain) = gain::estimate(&samples, &inside) else {
        return Ok(output(capture, mask, &inside, &[], 0.0));
    };
    let mut slot = vec![u32::MAX; pixels.len()];
    for (position, &index) in inside.iter().enumerate() {
        slot[index as usize] = position as u32;
    }
    let rough = directions(DIRECTIONS);
    let mut estimates = fit_all(&samples, &inside, &slot, gain, &rough);
    for _ in 0..options.rounds {
        let mut normals: Vec<Vec3> = estimates.iter().map(|estimate| estimate.normal).collect();
        for _ in 0..STEPS {
            normals = smooth(&estimates, &normals, &inside, &slot, samples.width(), options.coupling);
        }
        estimates = refit(&samples, &inside, &slot, gain, &estimates, &normals);
    }
    let mut normals: Vec<Vec3> = estimates.iter().map(|estimate| estimate.normal).collect();
    for _ in 0..STEPS {
        normals = smooth(&estimates, &normals, &inside, &slot, samples.width(), options.coupling);
    }
    for (estimate, normal) in estimates.iter_mut().zip(normals) {
        estimate.normal = normal;
    }
    Ok(output(capture, mask, &inside, &estimates, gain.value))
}

/// Every pixel by itself: first a sparse lattice of pixels with all hypotheses, then the others, for which the lattice's
/// normals around them are hypotheses enough where one of these explains the samples as well as there.
fn fit_all(samples: &Samples<'_>, inside: &[u32], slot: &[u32], gain: Gain, rough: &[Vec3]) -> Vec<Estimate> {
    let width = samples.width();
    let is_sparse = |index: usize| (index % width).is_multiple_of(SPARSE) && (index / width).is_multiple_of(SPARSE);
    let mut estimates = vec![unknown(); inside.len()];
    let sparse: Vec<u32> = inside.iter().copied().filter(|&index| is_sparse(index as usize)).collect();
    let fitted: Vec<Estimate> = sparse
        .par_iter()
        .with_min_len(64)
        .map(|&index| fit_freely(samples, index as usize, gain, rough))
        .collect();
    for (&index, estimate) in sparse.iter().zip(fitted) {
        estimates[slot[index as usize] as usize] = estimate;
    }
    let known = &estimates;
    let fit_other = |(own, &index): (usize, &u32)| {
        let index = index as usize;
        if is_sparse(index) {
            return known[own];
        }
        let around = lattice_around(index, width, slot).map(|slot| known[slot]);
        fit_near(samples, index, gain, around).unwrap_or_else(|| fit_freely(samples, index, gain, rough))
    };
    inside.par_iter().enumerate().with_min_len(256).map(fit_other).collect()
}

/// Slots of the lattice's pixels at the corners of a pixel's cell.
fn lattice_around(index: usize, width: usize, slot: &[u32]) -> impl Iterator<Item = usize> {
    let (x, y) = (index % width / SPARSE * SPARSE, index / width / SPARSE * SPARSE);
    let corners = [(x, y), (x + SPARSE, y), (x, y + SPARSE), (x + SPARSE, y + SPARSE)];
    corners.into_iter().filter_map(move |(x, y)| {
        let slot = (x < width).then(|| slot.get(y * width + x).copied()).flatten()?;
        (slot != u32::MAX).then_some(slot as usize)
    })
}

/// The best of some normals, refined; none when it explains the samples less well than it did where it came from.
fn fit_near(
    samples: &Samples<'_>,
    index: usize,
    gain: Gain,
    around: impl Iterator<Item = Estimate>,
) -> Option<Estimate> {
    let pixel = samples.pixel(index, gain.value)?;
    let judged = around
        .filter(|estimate| estimate.cost < EXPLAINED)
        .map(|estimate| (pixel.cost(estimate.normal, estimate.albedo), estimate));
    let (_, best) = judged.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let refined = pixel.refine(best.normal, best.albedo, gain.prior, 2);
    (refined.cost < best.cost + AS_WELL && refined.used >= 3).then_some(refined)
}

/// A pixel with all hypotheses.
fn fit_freely(samples: &Samples<'_>, index: usize, gain: Gain, rough: &[Vec3]) -> Estimate {
    samples.pixel(index, gain.value).map_or_else(unknown, |pixel| {
        fit(&pixel, gain, &triples(&pixel.lights, pixel.count), rough)
    })
}

fn fit(pixel: &Pixel, gain: Gain, tried: &[Triple], rough: &[Vec3]) -> Estimate {
    let mut best = (f32::INFINITY, pixel.to_camera, 1.0);
    for triple in tried {
        let scaled = triple.scaled_normal(&pixel.signal);
        let length = scaled.length();
        if length.is_nan() || length < 1e-6 {
            continue;
        }
        let normal = scaled / length;
        let albedo = if gain.prior > 100.0 { 1.0 } else { length };
        let cost = pixel.cost(normal, albedo) + 0.5 * gain.prior * albedo.ln().powi(2);
        if cost < best.0 {
            best = (cost, normal, albedo);
        }
    }
    let mut estimate = pixel.refine(best.1, best.2, gain.prior, 3);
    if estimate.cost > EXPLAINED || estimate.used < 3 {
        let coarse = rough
            .iter()
            .map(|&normal| (pixel.cost(normal, 1.0), normal))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, normal)) = coarse {
            let other = pixel.refine(normal, 1.0, gain.prior, 4);
            if other.cost < estimate.cost {
                estimate = other;
            }
        }
    }
    estimate
}

/// Every pixel anew, started from its neighbourhood's normal where that explains it as well as its own.
fn refit(
    samples: &Samples<'_>,
    inside: &[u32],
    slot: &[u32],
    gain: Gain,
    estimates: &[Estimate],
    smoothed: &[Vec3],
) -> Vec<Estimate> {
    let again = |(own, &index): (usize, &u32)| {
        let before = estimates[own];
        let Some(pixel) = samples.pixel(index as usize, gain.value) else {
            return before;
        };
        let albedo = before.albedo;
        let mut best = before;
        let mut consider = |start: Vec3| {
            let other = pixel.refine(start, albedo, gain.prior, 2);
            let toll = |estimate: &Estimate| estimate.cost + disagreement(estimate.normal, smoothed[own]);
            if toll(&other) < toll(&best) {
                best = other;
            }
        };
        consider(smoothed[own]);
        for neighbour in neighbours(index as usize, samples.width(), slot) {
            if (estimates[neighbour].normal - before.normal).length_squared() > 0.04 {
                consider(estimates[neighbour].normal);
            }
        }
        best
    };
    inside.par_iter().enumerate().with_min_len(256).map(again).collect()
}

/// Cost of standing off from the neighbourhood: grows like a squared sigma of 10 degrees, then ever more slowly.
fn disagreement(normal: Vec3, smoothed: Vec3) -> f32 {
    let square = (normal - smoothed).length_squared() / 0.03;
    4.0 * square / (1.0 + square)
}

fn unknown() -> Estimate {
    Estimate {
        normal: Vec3::NAN,
        albedo: f32::NAN,
        cost: f32::INFINITY,
        shadows: 0,
        information: glam::Mat3::ZERO,
        misfit: 0.0,
        used: 0,
    }
}

fn output(capture: &Capture<'_>, mask: &Mask, inside: &[u32], estimates: &[Estimate], gain: f32) -> NormalSolution {
    let (width, height) = (capture.stack.width(), capture.stack.height());
    let mut solution = NormalSolution {
        normals: Image::filled(width, height, [f32::NAN; 3]),
        albedo: Image::filled(width, height, f32::NAN),
        confidence: Image::filled(width, height, 0.0),
        residual: Image::filled(width, height, f32::NAN),
        shadows: Image::filled(width, height, 0),
        lights_used: Image::filled(width, height, 0),
        mask: mask.clone(),
        gain: f64::from(gain),
    };
    for (&index, estimate) in inside.iter().zip(estimates) {
        let index = index as usize;
        if !estimate.normal.is_finite() {
            continue;
        }
        let misfit = (estimate.misfit / f32::from(estimate.used.max(1))).sqrt();
        let lights = f32::from(estimate.used.saturating_sub(1)) / 3.0;
        solution.normals.pixels_mut()[index] = estimate.normal.to_array();
        solution.albedo.pixels_mut()[index] = estimate.albedo;
        solution.confidence.pixels_mut()[index] = lights.min(1.0) / (1.0 + (misfit / 3.0).powi(2));
        solution.residual.pixels_mut()[index] = misfit;
        solution.shadows.pixels_mut()[index] = estimate.shadows;
        solution.lights_used.pixels_mut()[index] = estimate.used;
    }
    solution
}
