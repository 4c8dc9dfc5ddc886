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
/// Cosine between normals from which the same minimum is found: 5 degrees, less than half of a first step.
const ALIKE: f32 = 0.996;
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

/// The hypothesis that explains a pixel best. One like the first leads where that one leads, so on a smooth surface
/// nothing has to be judged.
#[inline]
fn best_of(pixel: &Pixel, around: impl Iterator<Item = Estimate>) -> Option<Estimate> {
    let mut known = around.filter(|estimate| estimate.cost.is_finite());
    let mut best = known.next()?;
    let first = best.normal;
    let mut least = f32::NAN;
    for other in known.filter(|other| other.normal.dot(first) < ALIKE) {
        if least.is_nan() {
            least = pixel.cost(best.normal, best.albedo);
        }
        let cost = pixel.cost(other.normal, other.albedo);
        if cost < least {
            (least, best) = (cost, other);
        }
    }
    Some(best)
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

    /// The best of the normals around, refined. Where that does not explain the samples every three lights are asked,
    /// and all directions if it explains them less well than where it came from.
    #[inline]
    fn fit_near(&self, index: u32, around: impl Iterator<Item = Estimate>) -> Estimate {
        let Some(pixel) = self.samples.pixel(index as usize, self.gain.value) else {
            return Estimate::UNKNOWN;
        };
        let Some(best) = best_of(&pixel, around) else {
            return self.try_everything(&pixel, index);
        };
        let refined = pixel.refine(best.normal, best.albedo, self.gain.prior, 2);
        let is_as_good = refined.cost < best.cost + AS_WELL;
        if is_as_good && is_explained(&refined) {
            return refined;
        }
        let found = better(refined, self.best_triple(&pixel, index));
        if is_as_good || is_explained(&found) {
            return found;
        }
        better(found, self.best_direction(&pixel))
    }

    fn fit_freely(&self, index: u32) -> Estimate {
        let pixel = self.samples.pixel(index as usize, self.gain.value);
        pixel.map_or(Estimate::UNKNOWN, |pixel| self.try_everything(&pixel, index))
    }

    fn try_everything(&self, pixel: &Pixel, index: u32) -> Estimate {
        let found = self.best_triple(pixel, index);
        if is_explained(&found) {
            return found;
        }
        better(found, self.best_direction(pixel))
    }

    /// From every three lights as if they alone reached the pixel.
    fn best_triple(&self, pixel: &Pixel, index: u32) -> Estimate {
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
        pixel.refine(best.1, best.2, prior, 3)
    }

    /// From directions all over the sphere.
    fn best_direction(&self, pixel: &Pixel) -> Estimate {
        let judged = self.rough.iter().map(|&normal| (pixel.cost(normal, 1.0), normal));
        let best = judged.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(Estimate::UNKNOWN, |(_, normal)| {
            pixel.refine(normal, 1.0, self.gain.prior, 4)
        })
    }
}

/// Whether so good an explanation needs no other.
#[inline]
fn is_explained(estimate: &Estimate) -> bool {
    estimate.cost < EXPLAINED && estimate.used >= 3
}

/// The one of lower cost.
#[inline]
fn better(one: Estimate, other: Estimate) -> Estimate {
    if other.cost < one.cost { other } else { one }
}
