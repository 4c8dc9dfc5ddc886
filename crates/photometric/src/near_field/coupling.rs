//! Neighbours help where a pixel's own samples say little.
//!
//! Every pixel keeps its own normal as firmly as its samples hold it (an inverse covariance) and is drawn towards its
//! neighbours, less the more they differ (Perona and Malik 1990, with the weight of Geman and `McClure` 1985), so that
//! folds stay folds.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::pixel::{Estimate, solve};
use super::pixels::Pixels;

/// Neighbours that differ by more than this belong to another face: three sigmas of a usual pixel, radians.
const FOLD: f32 = 0.10;
/// Steps; what reaches further than so many pixels is not noise.
const STEPS: usize = 6;
/// A pixel whose samples say nothing still holds its normal so firmly.
const LEAST_FIRMNESS: f32 = 1e-2;

/// Normals after coupling. `strength` is the inverse variance of the difference between neighbours.
pub(crate) fn couple(estimates: &[Estimate], pixels: &Pixels, strength: f32) -> Vec<Vec3> {
    let mut normals: Vec<Vec3> = estimates.iter().map(|estimate| estimate.normal).collect();
    for _ in 0..STEPS {
        normals = step(estimates, &normals, pixels, strength);
    }
    normals
}

/// Every pixel anew from its samples and its neighbours' present normals.
fn step(estimates: &[Estimate], normals: &[Vec3], pixels: &Pixels, strength: f32) -> Vec<Vec3> {
    let smoothed = |(own, &index): (usize, &u32)| {
        let estimate = &estimates[own];
        let normal = normals[own];
        let mut matrix = estimate.information + Mat3::from_diagonal(Vec3::splat(LEAST_FIRMNESS));
        let mut right = matrix * estimate.normal;
        let mut pulled = 0.0;
        for neighbour in pixels.neighbours(index) {
            let other = normals[neighbour];
            let apart = 1.0 + (other - normal).length_squared() * (1.0 / (FOLD * FOLD));
            let weight = strength / (apart * apart);
            // A neighbour without a normal is NaN, and so is its weight.
            if weight > 0.0 {
                pulled += weight;
                right += other * weight;
            }
        }
        matrix += Mat3::from_diagonal(Vec3::splat(pulled));
        let moved = solve(matrix, right).unwrap_or(normal).normalize_or_zero();
        if moved == Vec3::ZERO { normal } else { moved }
    };
    let all = pixels.inside.par_iter().enumerate().with_min_len(1024);
    all.map(smoothed).collect()
}
