//! Every pixel's normal by itself.

use glam::Vec3;
use rayon::prelude::*;

use super::candidates::{bright, directions};
use super::gain::Gain;
use super::pixel::{Estimate, Pixel};
use super::pixels::Pixels;
use super::samples::Samples;

/// Directions tried at pixels that no three lights explain.
const DIRECTIONS: usize = 48;
/// A pixel is explained when its cost is below this: two shadows and the noise of the rest.
const EXPLAINED: f32 = 16.0;
/// Pixels between those that are fitted with all hypotheses.
const SPARSE: usize = 4;
/// A neighbour's normal is as good here as there when it costs no more than this beyond: less than a shadow.
const AS_WELL: f32 = 4.0;
/// From this prior on the albedo is known well enough to be left alone while hypotheses are judged.
const KNOWN_ALBEDO: f32 = 100.0;

/// Normals at some of the pixels, or at those of an image of half the size.
pub(crate) struct Known<'a> {
    pub(crate) pixels: &'a Pixels,
    pub(crate) estimates: &'a [Estimate],
}

/// What all pixels share.
struct Fitter<'a> {
    samples: &'a Samples<'a>,
    gain: Gain,
    rough: Vec<Vec3>,
}

/// All pixels. Hypotheses are the normals of `coarse`, an image of half the size, where one of these explains the
/// samples as well as it did there; without it those of a sparse lattice of pixels. Only lattice and unexplained pixels
/// try everything.
pub(crate) fn fit_all(samples: &Samples<'_>, pixels: &Pixels, gain: Gain, coarse: Option<&Known<'_>>) -> Vec<Estimate> {
    let fitter = Fitter {
        samples,
        gain,
        rough: directions(DIRECTIONS),
    };
    match coarse {
        Some(coarse) => fitter.fit_below(pixels, coarse),
        None => fitter.fit_from_lattice(pixels),
    }
}

impl Fitter<'_> {
    fn fit_below(&self, pixels: &Pixels, coarse: &Known<'_>) -> Vec<Estimate> {
        let fit = |&index: &u32| {
            let (x, y) = pixels.place(index);
            // The coarse pixel that holds this one, and the nearest beside it in both directions.
            let (column, row) = (x / 2, y / 2);
            let (beside, below) = (
                if x % 2 == 0 { column.wrapping_sub(1) } else { column + 1 },
                if y % 2 == 0 { row.wrapping_sub(1) } else { row + 1 },
            );
            let places = [(column, row), (beside, row), (column, below)];
            let slots = places.into_iter().filter_map(|(x, y)| coarse.pixels.slot(x, y));
            self.fit_near(index, slots.map(|slot| coarse.estimates[slot]))
        };
        pixels.inside.par_iter().with_min_len(256).map(fit).collect()
    }

    fn fit_from_lattice(&self, pixels: &Pixels) -> Vec<Estimate> {
        let is_sparse = |index: u32| {
            let (x, y) = pixels.place(index);
            x.is_multiple_of(SPARSE) && y.is_multiple_of(SPARSE)
        };
        let first = |&index: &u32| {
            if is_sparse(index) {
                self.fit_freely(index)
            } else {
                Estimate::UNKNOWN
            }
        };
        let lattice: Vec<Estimate> = pixels.inside.par_iter().with_min_len(256).map(first).collect();
        let second = |(own, &index): (usize, &u32)| {
            if is_sparse(index) {
                return lattice[own];
            }
            let (x, y) = pixels.place(index);
            let (x, y) = (x / SPARSE * SPARSE, y / SPARSE * SPARSE);
            let corners = [(x, y), (x + SPARSE, y), (x, y + SPARSE), (x + SPARSE, y + SPARSE)];
            let slots = corners.into_iter().filter_map(|(x, y)| pixels.slot(x, y));
            self.fit_near(index, slots.map(|slot| lattice[slot]))
        };
        pixels
            .inside
            .par_iter()
            .enumerate()
            .with_min_len(256)
            .map(second)
            .collect()
    }

    /// The best of some normals, refined; everything is tried when it explains the samples less well than it did where
    /// it came from.
    #[inline]
    fn fit_near(&self, index: u32, around: impl Iterator<Item = Estimate>) -> Estimate {
        let Some(pixel) = self.samples.pixel(index as usize, self.gain.value) else {
            return Estimate::UNKNOWN;
        };
        let judged = around
            .filter(|estimate| estimate.cost < EXPLAINED)
            .map(|estimate| (pixel.cost(estimate.normal, estimate.albedo), estimate));
        let refined = judged.min_by(|a, b| a.0.total_cmp(&b.0)).and_then(|(_, best)| {
            let refined = pixel.refine(best.normal, best.albedo, self.gain.prior, 2);
            (refined.cost < best.cost + AS_WELL && refined.used >= 3).then_some(refined)
        });
        refined.unwrap_or_else(|| self.try_everything(&pixel, index))
    }

    fn fit_freely(&self, index: u32) -> Estimate {
        let pixel = self.samples.pixel(index as usize, self.gain.value);
        pixel.map_or(Estimate::UNKNOWN, |pixel| self.try_everything(&pixel, index))
    }

    fn try_everything(&self, pixel: &Pixel, index: u32) -> Estimate {
        let Gain { prior, .. } = self.gain;
        let mut best = (f32::INFINITY, pixel.to_camera, 1.0);
        let lit = bright(&pixel.signal, pixel.brightest);
        let triples = self.samples.triples(index as usize).iter();
        for triple in triples.filter(|triple| triple.is_among(lit)) {
            let scaled = triple.scaled_normal(&pixel.signal);
            let length = scaled.length();
            if length.is_nan() || length < 1e-6 {
                continue;
            }
            let normal = scaled / length;
            let albedo = if prior > KNOWN_ALBEDO { 1.0 } else { length };
            let cost = pixel.cost(normal, albedo) + 0.5 * prior * albedo.ln().powi(2);
            if cost < best.0 {
                best = (cost, normal, albedo);
            }
        }
        let estimate = pixel.refine(best.1, best.2, prior, 3);
        if estimate.cost < EXPLAINED && estimate.used >= 3 {
            return estimate;
        }
        let judged = self.rough.iter().map(|&normal| (pixel.cost(normal, 1.0), normal));
        let other = judged
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, normal)| pixel.refine(normal, 1.0, prior, 4));
        other.filter(|other| other.cost < estimate.cost).unwrap_or(estimate)
    }
}
