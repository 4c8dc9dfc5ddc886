//! Neighbours help where a pixel's own samples say little.
//!
//! Every pixel keeps its own normal as firmly as its samples hold it (an inverse covariance) and is drawn towards its
//! neighbours, less the more they differ (Perona and Malik 1990, with the weight of Geman and `McClure` 1985), so that
//! folds stay folds.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::pixel::{Estimate, solve};

/// Neighbours that differ by more than this belong to another face: three sigmas of a usual pixel, radians.
const FOLD: f32 = 0.10;

/// One step: every pixel anew from its samples and its neighbours' present normals. `slot` gives the position of a
/// pixel in `estimates`, or `u32::MAX`.
pub(crate) fn smooth(
    estimates: &[Estimate],
    normals: &[Vec3],
    inside: &[u32],
    slot: &[u32],
    width: usize,
    strength: f32,
) -> Vec<Vec3> {
    let smoothed = |(own, &index): (usize, &u32)| {
        let estimate = &estimates[own];
        let normal = normals[own];
        let mut matrix = estimate.information + Mat3::from_diagonal(Vec3::splat(1e-2));
        let mut right = matrix * estimate.normal;
        for neighbour in neighbours(index as usize, width, slot) {
            let other = normals[neighbour];
            let apart = (other - normal).length_squared() / (FOLD * FOLD);
            let weight = strength / ((1.0 + apart) * (1.0 + apart));
            matrix += Mat3::from_diagonal(Vec3::splat(weight));
            right += other * weight;
        }
        let moved = solve(matrix, right).unwrap_or(normal).normalize_or_zero();
        if moved == Vec3::ZERO { normal } else { moved }
    };
    inside.par_iter().enumerate().with_min_len(1024).map(smoothed).collect()
}

/// Slots of the four neighbours that belong to the mask.
pub(crate) fn neighbours(index: usize, width: usize, slot: &[u32]) -> impl Iterator<Item = usize> {
    let x = index % width;
    let around = [
        (x > 0).then(|| index.wrapping_sub(1)),
        (x + 1 < width).then_some(index + 1),
        index.checked_sub(width),
        (index + width < slot.len()).then_some(index + width),
    ];
    let slots = around.map(|neighbour| neighbour.map_or(u32::MAX, |index| slot[index]));
    slots
        .into_iter()
        .filter(|&slot| slot != u32::MAX)
        .map(|slot| slot as usize)
}
