//! Samples without ambient light, smoothed row by row.

use std::ops::Range;

use super::grid::{Grid, Prediction, SQUARE};
use super::states::{LIT, UNKNOWN, most};
use crate::error::PhotometricError;
use crate::solution::Capture;

/// Standard deviation of the mean of 3 x 3 samples weighted (1 2 1) both ways, in units of one sample's: 6/16.
const SMOOTHED_SIGMA: f32 = 0.375;

/// The images of a capture in the order of its rig.
pub(super) struct Signals<'a> {
    dark: &'a [u16],
    lit: Vec<&'a [u16]>,
    width: usize,
    height: usize,
    saturation: u16,
    variance_per_dn: f32,
    variance_in_dark: f32,
}

/// One row of every light, smoothed.
pub(super) struct RowSums {
    width: usize,
    samples: Vec<f32>,
    largest: Vec<f32>,
    sigmas: Vec<f32>,
    dark: Vec<i32>,
    /// Sums over three rows, with the first and the last repeated.
    columns: Vec<f32>,
    /// Columns beside or at a saturated sample, for each light.
    saturated: Vec<Vec<usize>>,
}

impl<'a> Signals<'a> {
    /// Refuses a capture without an image of some panel.
    pub(super) fn new(capture: &Capture<'a>) -> Result<Self, PhotometricError> {
        let stack = capture.stack;
        let image = |channel: u8| {
            let image = stack.light(channel).map(imaging::Image::pixels);
            image.ok_or_else(|| PhotometricError::NoImage {
                channel,
                present: stack.channels().collect(),
            })
        };
        let lit = capture
            .rig
            .channels()
            .into_iter()
            .map(image)
            .collect::<Result<_, _>>()?;
        let in_dark = capture.noise.difference_variance(0.0, 0.0);
        Ok(Self {
            dark: stack.dark().pixels(),
            lit,
            width: stack.width(),
            height: stack.height(),
            saturation: stack.saturation(),
            variance_per_dn: (capture.noise.difference_variance(1000.0, 0.0) - in_dark) / 1000.0,
            variance_in_dark: in_dark,
        })
    }

    /// Fills some columns of `sums` for one row; beyond the image its border goes on.
    pub(super) fn smooth_row(&self, y: usize, columns: Range<usize>, sums: &mut RowSums) {
        let rows = [y.saturating_sub(1), y, (y + 1).min(self.height - 1)];
        let wide = columns.start.saturating_sub(1)..(columns.end + 1).min(self.width);
        let of = |image: &'a [u16]| rows.map(|row| &image[row * self.width..][wide.clone()]);
        let [above, here, below] = of(self.dark);
        let dark = &mut sums.dark[wide.clone()];
        for (sum, ((&a, &b), &c)) in dark.iter_mut().zip(above.iter().zip(here).zip(below)) {
            *sum = weighted(a, b, c);
        }
        sums.largest[columns.clone()].fill(0.0);
        for (light, image) in self.lit.iter().enumerate() {
            let lit = of(image);
            sums.smooth_light(light, lit, &columns, &wide);
            find_saturated(lit, self.saturation, wide.start, &mut sums.saturated[light]);
        }
        let sigmas = sums.sigmas[columns.clone()].iter_mut();
        for (sigma, &largest) in sigmas.zip(&sums.largest[columns]) {
            *sigma = SMOOTHED_SIGMA * (self.variance_in_dark + self.variance_per_dn * largest).sqrt();
        }
    }
}

impl RowSums {
    pub(super) fn new(width: usize, lights: usize) -> Self {
        Self {
            width,
            samples: vec![0.0; width * lights],
            largest: vec![0.0; width],
            sigmas: vec![0.0; width],
            dark: vec![0; width],
            columns: vec![0.0; width + 2],
            saturated: vec![Vec::new(); lights],
        }
    }

    /// Columns of the row.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// One light's samples, digital numbers.
    pub(super) fn samples(&self, light: usize) -> &[f32] {
        &self.samples[light * self.width..(light + 1) * self.width]
    }

    /// The largest sample of each pixel, at least 0.
    pub(super) fn largest(&self) -> &[f32] {
        &self.largest
    }

    /// Standard deviation of a sample as large as the largest.
    pub(super) fn sigmas(&self) -> &[f32] {
        &self.sigmas
    }

    /// `rows` are the samples of the `wide` columns: those asked for and one to either side, where there is one.
    fn smooth_light(&mut self, light: usize, rows: [&[u16]; 3], columns: &Range<usize>, wide: &Range<usize>) {
        let [above, here, below] = rows;
        let sums = &mut self.columns[wide.start + 1..=wide.end];
        let rows = above.iter().zip(here).zip(below).zip(&self.dark[wide.clone()]);
        for (sum, (((&a, &b), &c), &dark)) in sums.iter_mut().zip(rows) {
            *sum = (weighted(a, b, c) - dark) as f32;
        }
        self.columns[0] = self.columns[1];
        self.columns[self.width + 1] = self.columns[self.width];
        let samples = &mut self.samples[light * self.width..][columns.clone()];
        let around = &self.columns[columns.start..columns.end + 2];
        let around = around.iter().zip(&around[1..]).zip(&around[2..]);
        let largest = &mut self.largest[columns.clone()];
        for ((sample, largest), ((&a, &b), &c)) in samples.iter_mut().zip(largest).zip(around) {
            *sample = (a + 2.0 * b + c) * (1.0 / 16.0);
            *largest = most(*largest, *sample);
        }
    }

    /// Corrects one light's states where samples are saturated: lit where its own is, unknown where a prediction is
    /// made of one.
    pub(super) fn mark_saturated(&self, grid: &Grid, band: usize, light: usize, states: &mut [i8]) {
        for (source, columns) in self.saturated.iter().enumerate() {
            for &x in columns {
                let uses = |prediction: &Prediction| prediction.sources.contains(&source);
                let predictions = grid.square(x / SQUARE, band)[light].predictions;
                if predictions.is_some_and(|both| both.iter().any(uses)) {
                    states[x] = UNKNOWN;
                }
            }
        }
        for &x in &self.saturated[light] {
            if grid.square(x / SQUARE, band)[light].predictions.is_some() {
                states[x] = LIT;
            }
        }
    }
}

fn weighted(a: u16, b: u16, c: u16) -> i32 {
    i32::from(a) + 2 * i32::from(b) + i32::from(c)
}

/// Columns beside or at a saturated sample, of rows that begin at a column `start`.
fn find_saturated(rows: [&[u16]; 3], saturation: u16, start: usize, found: &mut Vec<usize>) {
    found.clear();
    let brightest = |row: &[u16]| row.iter().fold(0, |most, &raw| if raw > most { raw } else { most });
    if rows.iter().all(|row| brightest(row) < saturation) {
        return;
    }
    let width = rows[0].len();
    let is_saturated = |x: &usize| {
        let near = x.saturating_sub(1)..(x + 2).min(width);
        rows.iter()
            .any(|row| row[near.clone()].iter().any(|&raw| raw >= saturation))
    };
    found.extend((0..width).filter(is_saturated).map(|x| x + start));
}
