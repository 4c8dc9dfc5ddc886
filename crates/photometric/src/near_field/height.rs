//! How high a surface of known shape stands, from the light alone.
//!
//! A surface that is taken to be too low or too high meets every near panel from a wrong direction and at a wrong
//! distance; its samples then fit worse, and its albedo seems to change over it. That tells the scale of a depth map
//! whose object is not seen to touch the table, as a tall one that is widest far above it.

use rayon::prelude::*;

use super::pixel::Estimate;
use super::samples::Samples;

/// Pixels looked at.
const SAMPLES: usize = 800;
/// Pixels that fewer lights reach say little.
const LEAST_LIGHTS: u8 = 5;
/// Fewer pixels say nothing.
const LEAST_SAMPLES: usize = 100;
/// Inverse variance of the log albedo over a surface.
const ALBEDO_PRIOR: f32 = 1.0 / (0.03 * 0.03);
/// Most that one pixel adds.
const MOST_COST: f32 = 20.0;

/// A scale this near to 1 is believed only if it leaves less than that share of the cost: a print hides the light's change,
/// and what is left of it are the lights' own errors.
const NEAR: f32 = 0.05;
const EVIDENCE: f32 = 0.7;

/// Of some scales of the samples' depth the one under which they fit best, with the position between neighbouring scales
/// that a parabola through their costs says; none when too few pixels are lit well, or when one near 1
/// fits hardly better than the depth as it is.
pub(crate) fn best_scale(
    samples: &Samples<'_>,
    inside: &[u32],
    estimates: &[Estimate],
    gain: f32,
    scales: &[f32],
) -> Option<f32> {
    let lit: Vec<(u32, Estimate)> = inside
        .iter()
        .zip(estimates)
        .filter(|(_, estimate)| estimate.used >= LEAST_LIGHTS)
        .map(|(index, estimate)| (*index, *estimate))
        .collect();
    if lit.len() < LEAST_SAMPLES {
        return None;
    }
    let chosen: Vec<(u32, Estimate)> = lit.iter().copied().step_by(lit.len() / SAMPLES + 1).collect();
    let costs: Vec<f32> = scales
        .iter()
        .map(|&scale| cost(samples, &chosen, gain, scale))
        .collect();
    let best = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]))?;
    let as_it_is = (0..scales.len()).min_by(|&a, &b| (scales[a] - 1.0).abs().total_cmp(&(scales[b] - 1.0).abs()))?;
    let explains_little = costs[best] > EVIDENCE * costs[as_it_is];
    if best != as_it_is && explains_little && (scales[best] - 1.0).abs() < NEAR {
        return None;
    }
    Some(between(scales, &costs, best))
}

/// Mean cost of the pixels at a scale.
fn cost(samples: &Samples<'_>, chosen: &[(u32, Estimate)], gain: f32, scale: f32) -> f32 {
    let fit = |&(index, estimate): &(u32, Estimate)| {
        let pixel = samples.pixel_at_scale(index as usize, gain, scale)?;
        let refined = pixel.refine(estimate.normal, estimate.albedo, 0.0, 2);
        Some((refined.cost, refined.albedo.ln()))
    };
    let fitted: Vec<(f32, f32)> = chosen.par_iter().with_min_len(64).filter_map(fit).collect();
    let mut logs: Vec<f32> = fitted.iter().map(|(_, log)| *log).collect();
    logs.sort_by(f32::total_cmp);
    let usual = logs.get(logs.len() / 2).copied().unwrap_or(0.0);
    let of_pixel = |(cost, log): &(f32, f32)| (cost + 0.5 * ALBEDO_PRIOR * (log - usual).powi(2)).min(MOST_COST);
    fitted.iter().map(of_pixel).sum::<f32>() / fitted.len().max(1) as f32
}

/// The lowest point of the parabola through the best cost and its neighbours.
fn between(scales: &[f32], costs: &[f32], best: usize) -> f32 {
    let (Some(before), Some(after)) = (best.checked_sub(1), costs.get(best + 1)) else {
        return scales[best];
    };
    let (left, right) = (costs[before] - costs[best], after - costs[best]);
    let offset = 0.5 * (left - right) / (left + right).max(1e-9);
    scales[best] + offset * (scales[best + 1] - scales[before]) / 2.0
}
