//! Patches of one view that a cup could meet head on.

use geometry::nalgebra::{Point2, Vector3};
use rayon::prelude::*;

use crate::cup::Cup;
use crate::level::{Blocks, Level};
use crate::likelihood::{Alignment, single};
use crate::mean_shift::{fullest, mode};
use crate::moments::{Moments, Spread, add, products};
use crate::options::SearchOptions;
use crate::view::View;

/// Cells across the cup's radius that the search begins with, as a share of it.
const FIRST_WINDOW: f64 = 0.7;
/// Share of the cup's footprint that a patch must fill for being looked at: smaller ones are refused with their size.
const LEAST_MASS: f64 = 0.06;
/// Normals of one patch found twice differ by less, radians.
const SAME_ANGLE: f64 = 0.2;

/// A mode of the likelihood of one orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patch {
    /// Pixels.
    pub(crate) middle: Point2<f64>,
    /// A pixel of it near its middle.
    pub(crate) inside: Point2<f64>,
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
    let blocks = &level.blocks;
    if blocks.cells.is_empty() {
        return Found::default();
    }
    let radius = cup.radius() * view.input.camera.focal()[0] / distance / blocks.factor as f64;
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
    let reach = radius * blocks.factor as f64;
    let mut kept: Vec<Patch> = Vec::new();
    for patch in found {
        if kept.iter().all(|other| !same(other, &patch, reach)) {
            kept.push(patch);
        }
    }
    kept.truncate(search.patches);
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
    /// All likelihood of an orientation, and its patches: each is what hangs together where mean shift comes to rest, and
    /// is taken away before the next is looked for.
    fn patches(&self, axis: &Vector3<f64>) -> (f64, Vec<Patch>) {
        let mut weights = self.alignment.image(&self.level.blocks, axis);
        let mass = weights.iter().map(|&weight| f64::from(weight)).sum::<f64>();
        let (mut left, mut found) = (mass, Vec::new());
        while left >= self.least_mass && found.len() < self.modes {
            let moments = Moments::new(self.level.blocks.width, &weights);
            let start = fullest(&moments, self.least_half).filter(|(mass, _)| *mass >= self.least_mass);
            let Some(mode) = start.and_then(|(_, start)| mode(&moments, start, self.least_half)) else {
                break;
            };
            let Some(first) = nearest_cell(&weights, self.level.blocks.width, mode.middle) else {
                break;
            };
            let region = connected(&mut weights, &self.level.blocks, first);
            let taken: f64 = region.iter().map(|&(_, weight)| f64::from(weight)).sum();
            left -= taken;
            if taken >= self.least_mass {
                found.extend(self.patch(&region));
            }
        }
        (mass, found)
    }

    /// Middle, size and normal of a region: the region's own normal first, then all around it that faces that way.
    fn patch(&self, region: &[(usize, f32)]) -> Option<Patch> {
        let blocks = &self.level.blocks;
        let normal: Vector3<f64> = region
            .iter()
            .map(|&(at, weight)| self.normal(at) * f64::from(weight))
            .sum();
        let axis = single(&normal.try_normalize(1e-12)?);
        let (_, first) = region
            .iter()
            .map(|&(at, _)| (self.alignment.of_cell(&blocks.cells[at], &axis), at))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        let own = self.grown(first, &axis);
        let (mut sums, mut sum) = ([0.0; 6], Vector3::zeros());
        for &(at, weight) in &own {
            let weight = f64::from(weight);
            add(
                &mut sums,
                &products(weight, (at % blocks.width) as f64, (at / blocks.width) as f64),
            );
            sum += self.normal(at) * weight;
        }
        let spread = Spread::of(&sums)?;
        let inner = self.inner(&own, spread.middle)?;
        let scale = blocks.factor as f64;
        let (axes, _) = spread.ellipse();
        let inside = blocks.pixel((inner % blocks.width) as f64, (inner / blocks.width) as f64);
        Some(Patch {
            middle: blocks.pixel(spread.middle[0], spread.middle[1]),
            inside,
            axes: axes.map(|axis| axis * scale),
            mass: spread.mass * scale * scale,
            normal: sum.try_normalize(1e-12)?,
            object: self.level.object_at(&inside),
        })
    }

    /// What hangs together with a cell in its likelihood for a normal.
    fn grown(&self, first: usize, axis: &[f32; 3]) -> Vec<(usize, f32)> {
        let blocks = &self.level.blocks;
        let mut is_seen = vec![false; blocks.cells.len()];
        is_seen[first] = true;
        let mut found = vec![(first, self.alignment.of_cell(&blocks.cells[first], axis))];
        let mut next = 0;
        while let Some(&(at, _)) = found.get(next) {
            next += 1;
            for neighbour in blocks.neighbours(at).flatten() {
                if !std::mem::replace(&mut is_seen[neighbour], true) {
                    let weight = self.alignment.of_cell(&blocks.cells[neighbour], axis);
                    found.extend((weight > 0.0).then_some((neighbour, weight)));
                }
            }
        }
        found
    }

    /// Of the cells a cup's radius from where the region ends, or else farthest from it, the one nearest to its middle.
    fn inner(&self, region: &[(usize, f32)], middle: [f64; 2]) -> Option<usize> {
        let depths = peeled(region, &self.level.blocks);
        let deepest = depths.iter().map(|&(depth, _)| depth).max()?;
        let enough = deepest.min((self.least_half / FIRST_WINDOW).ceil() as usize);
        let deep = depths.iter().filter(|&&(depth, _)| depth >= enough).map(|&(_, at)| at);
        deep.min_by_key(|&at| squared_distance(at, self.level.blocks.width, middle))
    }

    fn normal(&self, cell: usize) -> Vector3<f64> {
        Vector3::from(self.level.blocks.cells[cell].normal.map(f64::from))
    }
}

/// The cell of some weight that is nearest to a position.
fn nearest_cell(weights: &[f32], width: usize, to: [f64; 2]) -> Option<usize> {
    let some = (0..weights.len()).filter(|&at| weights[at] > 0.0);
    some.min_by_key(|&at| squared_distance(at, width, to))
}

/// In hundredths of a cell, for ordering.
fn squared_distance(at: usize, width: usize, to: [f64; 2]) -> u64 {
    let (x, y) = ((at % width) as f64 - to[0], (at / width) as f64 - to[1]);
    ((x * x + y * y) * 100.0) as u64
}

/// How many layers of cells lie between each cell of a region and where the region ends.
fn peeled(region: &[(usize, f32)], blocks: &Blocks) -> Vec<(usize, usize)> {
    let mut inside = vec![false; blocks.cells.len()];
    for &(at, _) in region {
        inside[at] = true;
    }
    let is_rim = |&at: &usize| blocks.neighbours(at).any(|next| next.is_none_or(|next| !inside[next]));
    let mut layer: Vec<usize> = region.iter().map(|&(at, _)| at).filter(is_rim).collect();
    let mut found = Vec::with_capacity(region.len());
    let mut depth = 0;
    while !layer.is_empty() {
        for &at in &layer {
            inside[at] = false;
        }
        found.extend(layer.iter().map(|&at| (depth, at)));
        depth += 1;
        let mut next = Vec::new();
        for neighbour in layer.iter().flat_map(|&at| blocks.neighbours(at)).flatten() {
            if std::mem::take(&mut inside[neighbour]) {
                next.push(neighbour);
            }
        }
        layer = next;
    }
    found
}

/// Takes the cells of some weight that hang together with a first one out of an image.
fn connected(weights: &mut [f32], blocks: &Blocks, first: usize) -> Vec<(usize, f32)> {
    let mut found = vec![(first, std::mem::take(&mut weights[first]))];
    let mut next = 0;
    while let Some(&(at, _)) = found.get(next) {
        next += 1;
        for neighbour in blocks.neighbours(at).flatten() {
            if weights[neighbour] > 0.0 {
                found.push((neighbour, std::mem::take(&mut weights[neighbour])));
            }
        }
    }
    found
}

fn same(a: &Patch, b: &Patch, radius: f64) -> bool {
    let reach = (0.5 * radius).max(0.3 * a.axes[1].min(b.axes[1]));
    // A ring and what it encloses have one middle, but no pixel in common.
    let near = (a.middle - b.middle).norm() < reach && (a.inside - b.inside).norm() < reach;
    near && a.normal.dot(&b.normal) > SAME_ANGLE.cos()
}
