//! How lit every pixel is under every light: lit, in cast shadow, or neither.

use imaging::Mask;
use rayon::prelude::*;

use super::grid::{Grid, SQUARE, SquareLight};
use super::smoothing::{RowSums, Signals};
use crate::error::PhotometricError;
use crate::solution::Capture;

/// A pixel that shows all that is predicted.
pub(super) const LIT: i8 = -127;
/// Neither: facing away from the light, too dark to tell, saturated, or not looked at.
pub(super) const UNKNOWN: i8 = 0;
/// A pixel that shows nothing of what is predicted.
pub(super) const CAST: i8 = 127;

/// Predictions count in full from this share of the pixel's largest sample; below it a light hardly grazes the surface
/// and what it sends by way of the room is as much.
const LEAST_SHARE: f32 = 0.5;
/// Sigmas of noise by which a prediction must stand out to count in full.
const SIGMAS: f32 = 3.0;

/// States of all pixels under all lights; a row of every light after another.
pub(super) struct States {
    pub(super) width: usize,
    pub(super) height: usize,
    lights: usize,
    rows: Vec<i8>,
}

impl States {
    /// What lies outside the mask is taken to be level: light by way of the object's walls falls on it from everywhere
    /// but from above, and would spoil what other lights predict.
    pub(super) fn new(capture: &Capture<'_>, mask: Option<&Mask>, grid: &Grid) -> Result<Self, PhotometricError> {
        let signals = Signals::new(capture)?;
        let (width, height, lights) = (capture.stack.width(), capture.stack.height(), grid.light_count());
        let mut rows = vec![UNKNOWN; width * height * lights];
        let everywhere = vec![u8::MAX; width];
        let bands = rows.par_chunks_mut(width * lights * SQUARE).enumerate();
        bands.for_each_init(
            || RowSums::new(width, lights),
            |sums, (band, rows)| {
                let squares = grid.used_columns(band);
                let columns = squares.start * SQUARE..(squares.end * SQUARE).min(width);
                if columns.is_empty() {
                    return;
                }
                for (row, states) in rows.chunks_exact_mut(width * lights).enumerate() {
                    let y = band * SQUARE + row;
                    signals.smooth_row(y, columns.clone(), sums);
                    let inside = mask.map_or(everywhere.as_slice(), |mask| mask.as_image().row(y));
                    row_states(sums, inside, grid, band, states);
                }
            },
        );
        Ok(Self {
            width,
            height,
            lights,
            rows,
        })
    }

    /// One row under one light.
    pub(super) fn row(&self, y: usize, light: usize) -> &[i8] {
        let start = (y * self.lights + light) * self.width;
        &self.rows[start..start + self.width]
    }
}

/// States of one row; all lights of it one after another.
fn row_states(sums: &RowSums, inside: &[u8], grid: &Grid, band: usize, states: &mut [i8]) {
    let width = sums.width();
    for (light, states) in states.chunks_exact_mut(width).enumerate() {
        for (column, states) in states.chunks_mut(SQUARE).enumerate() {
            let square = &grid.square(column, band)[light];
            run_states(sums, &inside[column * SQUARE..], square, light, column * SQUARE, states);
        }
        sums.mark_saturated(grid, band, light, states);
    }
}

/// States of the pixels of one row in one square; `inside` begins where `states` do.
fn run_states(sums: &RowSums, inside: &[u8], square: &SquareLight, light: usize, start: usize, states: &mut [i8]) {
    let Some([one, other]) = square.predictions else {
        return;
    };
    let range = start..start + states.len();
    let samples = &sums.samples(light)[range.clone()];
    let (largest, sigmas) = (&sums.largest()[range.clone()], &sums.sigmas()[range.clone()]);
    let [a, b, c] = one.sources.map(|source| &sums.samples(source)[range.clone()]);
    let d = &sums.samples(other.sources[2])[range];
    let ([wa, wb, wc], [va, vb, vd]) = (one.weights, other.weights);
    let margin = SIGMAS * square.noise_gain;
    let pixels = states.iter_mut().zip(samples).zip(largest).zip(sigmas).zip(inside);
    let sources = a.iter().zip(b).zip(c).zip(d);
    for (((((state, &sample), &largest), &sigma), &inside), (((&a, &b), &c), &d)) in pixels.zip(sources) {
        let by_others = least(wa * a + wb * b + wc * c, va * a + vb * b + vd * d);
        let predicted = if inside == 0 { square.level * a } else { by_others };
        let predicted = least(most(predicted, 0.0), largest);
        let scale = most(predicted, LEAST_SHARE * largest) + margin * sigma;
        // A sample below 0 is noise.
        *state = encode((predicted - 2.0 * most(sample, 0.0)) / scale);
    }
}

/// From lit (-1) to cast shadow (1), in 254 steps. Adding 1.5 times 2^23 leaves the rounded number in the lowest bits,
/// which compilers turn into vector code where they do not for a cast.
fn encode(state: f32) -> i8 {
    let clamped = least(most(state, -1.0), 1.0);
    (clamped * f32::from(CAST) + 12_582_912.0).to_bits() as i8
}

/// Without the care for NaN that keeps `f32::min` from being one instruction.
pub(super) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Likewise for `f32::max`.
pub(super) fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_encoded_from_lit_to_cast() {
        assert_eq!([-7.0, -1.0, 0.0, 1.0, 7.0].map(encode), [LIT, LIT, UNKNOWN, CAST, CAST]);
        assert_eq!([0.25, -0.5].map(encode), [32, -64]);
    }
}
