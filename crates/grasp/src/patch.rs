//! Patches of one view that a cup could meet head on.

use geometry::nalgebra::{Point2, Vector3};
use rayon::prelude::*;

use crate::cup::Cup;
use crate::level::Level;
use crate::likelihood::{Alignment, single};
use crate::mean_shift::{modes, window_around};
use crate::moments::{Moments, Spread, add, products};
use crate::options::SearchOptions;
use crate::view::View;

/// Cells across the cup's radius that the search begins with, as a share of it.
const FIRST_WINDOW: f64 = 0.7;
/// Share of the cup's footprint that a patch must fill for being looked at: smaller ones are refused with their size.
const LEAST_MASS: f64 = 0.06;
/// Normals of one patch found twice differ by less, radians.
const SAME_ANGLE: f64 = 0.2;
const POLISHING_ROUNDS: usize = 4;

/// A mode of the likelihood of one orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patch {
    /// Pixels.
    pub(crate) middle: Point2<f64>,
    /// Longer and shorter half axis of its ellipse, pixels.
    pub(crate) axes: [f64; 2],
    /// Of its likelihood, pixels.
    pub(crate) mass: f64,
    /// Base frame, unit.
    pub(crate) normal: Vector3<f64>,
    pub(crate) object: u16,
}

/// What a view has to offer.
#[derive(Debug, Default)]
pub(crate) struct Found {
    /// None twice, largest first.
    pub(crate) patches: Vec<Patch>,
    /// Largest mass of one orientation as a share of the cup's footprint.
    pub(crate) share: f64,
}

/// Share of the footprint that a patch must fill to be looked at.
pub(crate) const fn least_share() -> f64 {
    LEAST_MASS
}

/// All patches of a view.
pub(crate) fn find_patches(
    view: &View<'_>,
    orientations: &[Vector3<f64>],
    cup: &Cup,
    distance: f64,
    search: &SearchOptions,
) -> Found {
    let level = &view.level;
    if level.cells.is_empty() {
        return Found::default();
    }
    let radius = cup.radius() * view.input.camera.focal()[0] / distance / level.factor as f64;
    let finder = Finder {
        level,
        alignment: Alignment::new(search.half_likelihood),
        least_half: (FIRST_WINDOW * radius).max(2.0),
        least_mass: (LEAST_MASS * std::f64::consts::PI * radius * radius).max(3.0),
        modes: search.modes,
    };
    let found: Vec<(f64, Vec<Patch>)> = orientations.par_iter().map(|axis| finder.patches(axis)).collect();
    let mass = found.iter().map(|(mass, _)| *mass).fold(0.0, f64::max);
    let mut found: Vec<Patch> = found.into_iter().flat_map(|(_, patches)| patches).collect();
    found.sort_by(|a, b| b.mass.total_cmp(&a.mass));
    let reach = radius * level.factor as f64;
    let mut kept: Vec<Patch> = Vec::new();
    for patch in found {
        if kept.iter().all(|other| !same(other, &patch, reach)) {
            kept.push(patch);
        }
    }
    Found {
        patches: kept,
        share: mass / (std::f64::consts::PI * radius * radius),
    }
}

struct Finder<'a> {
    level: &'a Level,
    alignment: Alignment,
    least_half: f64,
    least_mass: f64,
    modes: usize,
}

impl Finder<'_> {
    /// All likelihood of an orientation, and its modes.
    fn patches(&self, axis: &Vector3<f64>) -> (f64, Vec<Patch>) {
        let weights = self.alignment.image(self.level, axis);
        let mass = weights.iter().map(|&weight| f64::from(weight)).sum::<f64>();
        if mass < self.least_mass {
            return (mass, Vec::new());
        }
        let moments = Moments::new(self.level.width, &weights);
        let modes = modes(&moments, self.least_half, self.least_mass, self.modes);
        (
            mass,
            modes.iter().filter_map(|mode| self.polished(mode, axis)).collect(),
        )
    }

    /// Joint mean shift in place and normal: the likelihood follows the patch's own normal.
    fn polished(&self, mode: &Spread, axis: &Vector3<f64>) -> Option<Patch> {
        let (mut spread, mut normal) = (*mode, *axis);
        for _ in 0..POLISHING_ROUNDS {
            (spread, normal) = self.polish(&spread, &normal)?;
        }
        let scale = self.level.factor as f64;
        let (axes, _) = spread.ellipse();
        let middle = self.level.pixel(spread.middle[0], spread.middle[1]);
        Some(Patch {
            middle,
            axes: axes.map(|axis| axis * scale),
            mass: spread.mass * scale * scale,
            normal,
            object: self.level.object_at(&middle),
        })
    }

    fn polish(&self, spread: &Spread, normal: &Vector3<f64>) -> Option<(Spread, Vector3<f64>)> {
        let half = window_around(spread, self.least_half);
        let axis = single(normal);
        let range = |k: usize, size: usize| {
            let first = (spread.middle[k] - half[k]).ceil().max(0.0) as usize;
            let last = (spread.middle[k] + half[k]).floor().max(0.0) as usize;
            first..(last + 1).min(size)
        };
        let (mut sums, mut sum) = ([0.0; 6], Vector3::zeros());
        for y in range(1, self.level.height) {
            for x in range(0, self.level.width) {
                let cell = &self.level.cells[y * self.level.width + x];
                let weight = f64::from(self.alignment.of_cell(cell, &axis));
                if weight > 0.0 {
                    add(&mut sums, &products(weight, x as f64, y as f64));
                    sum += Vector3::from(cell.normal.map(f64::from)) * weight;
                }
            }
        }
        Some((Spread::of(&sums)?, sum.try_normalize(1e-12)?))
    }
}

fn same(a: &Patch, b: &Patch, radius: f64) -> bool {
    let near = (a.middle - b.middle).norm() < (0.5 * radius).max(0.3 * a.axes[1]);
    near && a.normal.dot(&b.normal) > SAME_ANGLE.cos()
}
