//! Steps from lit to cast shadow, walking away from a light.

use imaging::Image;
use rayon::prelude::*;

use super::grid::{Grid, SQUARE};
use super::padded::Padded;
use super::states::{LIT, States};

/// The strength of a step from fully lit to fully in cast shadow.
const FULL: u8 = 127;

/// A share of a full step in the steps' own unit.
pub(super) fn quantised(share: f32) -> u8 {
    (share * f32::from(FULL)).round() as u8
}

/// Strength of a step as a share of a full one.
pub(super) fn confidence(strengths: &Padded) -> Image<f32> {
    let (width, height) = (strengths.width(), strengths.height());
    let mut confidence = Image::filled(width, height, 0.0);
    let rows = confidence.pixels_mut().par_chunks_exact_mut(width).enumerate();
    rows.with_min_len(SQUARE).for_each(|(y, row)| {
        for (confidence, &strength) in row.iter_mut().zip(strengths.row(y)) {
            *confidence = f32::from(strength) * (1.0 / f32::from(FULL));
        }
    });
    confidence
}

/// The strongest step of every pixel over the lights, beyond the difference between lit and unknown: a crease between a
/// lit facet and one that faces away is no edge, nor is the foot of that facet in its own shadow.
pub(super) fn strengths(states: &States, grid: &Grid) -> Padded {
    let mut strengths = Padded::zeros(states.width, states.height);
    let (width, stride) = (states.width, strengths.stride());
    let bands = strengths
        .bordered_rows_mut()
        .par_chunks_mut(stride * SQUARE)
        .enumerate();
    bands.for_each(|(band, rows)| {
        for column in grid.used_columns(band) {
            let (start, end) = (column * SQUARE, ((column + 1) * SQUARE).min(width));
            for (light, square) in grid.square(column, band).iter().enumerate() {
                if square.predictions.is_none() {
                    continue;
                }
                for (row, strengths) in rows.chunks_exact_mut(stride).enumerate() {
                    let at = [start, band * SQUARE + row];
                    run_steps(states, light, square.shift, at, &mut strengths[start + 1..=end]);
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
        *strength = (*strength).max(step(dark, lit));
    }
}

/// How far two states are apart, beyond half of the way from lit to cast shadow.
fn step(dark: i8, lit: i8) -> u8 {
    let above_lit = |state: i8| state.wrapping_sub(LIT).cast_unsigned();
    above_lit(dark).saturating_sub(above_lit(lit)).saturating_sub(FULL)
}

fn moved(row: usize, by: isize, height: usize) -> Option<usize> {
    row.checked_add_signed(by).filter(|&row| row < height)
}

#[cfg(test)]
mod tests {
    use super::super::states::{CAST, UNKNOWN};
    use super::*;

    #[test]
    fn only_a_step_from_lit_to_cast_shadow_counts() {
        assert_eq!(step(CAST, LIT), FULL);
        assert_eq!([step(LIT, CAST), step(CAST, UNKNOWN), step(UNKNOWN, LIT)], [0; 3]);
        assert_eq!(step(CAST, LIT + 27), 100);
    }
}
