//! How many digital numbers one unit of irradiance gives on the usual surface of a capture.

use rayon::prelude::*;

use super::candidates::{Triple, bright};
use super::pixel::Pixel;
use super::samples::Samples;

/// Pixels looked at; more do not move the mode.
const SAMPLES: usize = 2000;
/// Width of a class of the histogram: about the noise of one pixel's albedo.
const CLASS: f32 = 0.04;
const CLASSES: usize = 512;
/// Share of the pixels near the mode from which the surface counts as of one albedo.
const UNIFORM_SHARE: f32 = 0.5;

/// The usual surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gain {
    /// Digital numbers for one unit of irradiance.
    pub(crate) value: f32,
    /// Inverse variance of the log albedo over the surface.
    pub(crate) prior: f32,
}

/// The most frequent length of the scaled normals that explain their samples well; none when nothing is lit.
pub(crate) fn estimate(samples: &Samples<'_>, inside: &[u32]) -> Option<Gain> {
    let step = inside.len().div_ceil(SAMPLES).max(1);
    let chosen: Vec<u32> = inside.iter().copied().step_by(step).collect();
    let mut logs: Vec<f32> = chosen
        .par_iter()
        .filter_map(|&index| {
            samples
                .pixel(index as usize, 1.0)
                .and_then(|pixel| log_length(&pixel, samples.triples(index as usize)))
        })
        .collect();
    logs.sort_by(f32::total_cmp);
    let lowest = *logs.first()?;
    let mode = mode(&logs, lowest);
    let near = logs.iter().filter(|log| (*log - mode).abs() < 2.0 * CLASS).count() as f32 / logs.len() as f32;
    let spread = if near > UNIFORM_SHARE { 0.03 } else { 0.7 };
    Some(Gain {
        value: mode.exp(),
        prior: 1.0 / (spread * spread),
    })
}

fn mode(logs: &[f32], lowest: f32) -> f32 {
    let mut classes = vec![0_u32; CLASSES];
    for log in logs {
        let class = ((log - lowest) / CLASS) as usize;
        classes[class.min(CLASSES - 1)] += 1;
    }
    let smoothed = |class: usize| {
        let before = if class > 0 { classes[class - 1] } else { 0 };
        before + 2 * classes[class] + classes.get(class + 1).copied().unwrap_or(0)
    };
    let best = (0..CLASSES).max_by_key(|&class| smoothed(class)).unwrap_or(0);
    let middle = lowest + (best as f32 + 0.5) * CLASS;
    let near: Vec<f32> = logs
        .iter()
        .copied()
        .filter(|log| (log - middle).abs() < 1.5 * CLASS)
        .collect();
    near.get(near.len() / 2).copied().unwrap_or(middle)
}

/// Log of the length of the scaled normal that explains most lights; none for a pixel that fewer than four reach.
fn log_length(pixel: &Pixel, candidates: &[Triple]) -> Option<f32> {
    let lit = bright(&pixel.signal, pixel.brightest);
    let best = candidates
        .iter()
        .filter(|triple| triple.is_among(lit))
        .filter_map(|triple| {
            let scaled = triple.scaled_normal(&pixel.signal);
            let length = scaled.length();
            (length > 0.0 && length.is_finite()).then(|| (pixel.cost(scaled / length, length), scaled / length, length))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let refined = pixel.refine(best.1, best.2, 0.0, 2);
    let good = refined.used >= 4 && refined.misfit < 3.0 * f32::from(refined.used);
    good.then(|| refined.albedo.ln())
}
