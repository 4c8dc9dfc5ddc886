//! Steps from lit to cast shadow, walking away from a light.

use imaging::Image;
use rayon::prelude::*;

use super::grid::{Grid, SQUARE};
use super::states::{States, UNKNOWN};

/// The strength of a step from fully lit to fully in cast shadow.
const FULL: u8 = UNKNOWN;

/// A share of a full step in the steps' own unit.
pub(super) fn quantised(share: f32) -> u8 {
    (share * f32::from(FULL)).round() as u8
}

/// Strength of a step as a share of a full one.
pub(super) fn confidence(strengths: &Image<u8>) -> Image<f32> {
    let (width, height) = (strengths.width(), strengths.height());
    let mut confidence = Image::filled(width, height, 0.0);
    let pixels = confidence.pixels_mut().par_iter_mut().zip(strengths.pixels());
    pixels
        .with_min_len(1 << 14)
        .for_each(|(confidence, &strength)| *confidence = f32::from(strength) * (1.0 / f32::from(FULL)));
    confidence
}

/// The strongest step of every pixel over the lights, beyond the difference between lit and unknown: a crease between a
/// lit facet and one that faces away is no edge, nor is the foot of that facet in its own shadow.
pub(super) fn strengths(states: &States, grid: &Grid) -> Image<u8> {
    let (width, height) = (states.width, states.height);
    let mut strengths = Image::filled(width, height, 0_u8);
    let bands = strengths.pixels_mut().par_chunks_mut(width * SQUARE).enumerate();
    bands.for_each(|(band, rows)| {
        for (row, strengths) in rows.chunks_exact_mut(width).enumerate() {
            for (column, strengths) in strengths.chunks_mut(SQUARE).enumerate() {
                for light in 0..grid.light_count() {
                    let square = &grid.square(column, band)[light];
                    if square.predictions.is_some() {
                        let at = [column * SQUARE, band * SQUARE + row];
                        run_steps(states, light, square.shift, at, strengths);
                    }
                }
            }
        }
    });
    strengths
}

/// Steps under one light, of a run of pixels that begins `at` a column and row; pixels whose partners are outside the
/// image have none.
fn run_steps(states: &States, light: usize, [dx, dy]: [isize; 2], at: [usize; 2], strengths: &mut [u8]) {
    let (Some(away), Some(towards)) = (moved(at[1], dy, states.height), moved(at[1], -dy, states.height)) else {
        return;
    };
    let (away, towards) = (states.row(away, light), states.row(towards, light));
    let margin = dx.unsigned_abs();
    let first = at[0].max(margin);
    let end = (at[0] + strengths.len()).min(states.width.saturating_sub(margin));
    if first >= end {
        return;
    }
    let partners = |shift: isize| (first.wrapping_add_signed(shift))..(end.wrapping_add_signed(shift));
    let strengths = &mut strengths[first - at[0]..end - at[0]];
    let pairs = away[partners(dx)].iter().zip(&towards[partners(-dx)]);
    for (strength, (&dark, &lit)) in strengths.iter_mut().zip(pairs) {
        *strength = (*strength).max(dark.saturating_sub(lit).saturating_sub(UNKNOWN));
    }
}

fn moved(row: usize, by: isize, height: usize) -> Option<usize> {
    row.checked_add_signed(by).filter(|&row| row < height)
}
