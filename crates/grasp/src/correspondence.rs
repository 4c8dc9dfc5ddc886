//! Which patch of one view is which of the other.

use geometry::nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::cup::Cup;
use crate::options::PlanOptions;
use crate::patch::Patch;
use crate::surface::{Guess, Shown, Surface};
use crate::triangulate::triangulate;
use crate::view::View;

/// Pixels around a patch's middle in which its depth is taken.
const DEPTH_REACH: usize = 2;
/// Depths of two views that say where a patch is differ by less, metres.
const SAME_PLACE: f64 = 0.03;
/// Heights to both sides of a guess that are looked at: with depth, and without one; metres.
const RANGE_BY_DEPTH: f64 = 0.008;
const RANGE_BY_RAYS: f64 = 0.015;
/// Patches of the other view that one is compared with in detail, the most alike.
const COMPARED: usize = 2;
/// A point this far below the table is none.
const BELOW_TABLE: f64 = 0.01;

/// Patches that both views show, and those that only one does.
#[derive(Debug, Default)]
pub(crate) struct Correspondences {
    pub(crate) pairs: Vec<Surface>,
    /// View and patch.
    pub(crate) single: Vec<(usize, Shown)>,
}

/// Pairs each patch with at most one of the other view, the best first.
pub(crate) fn correspond(
    views: &[View<'_>],
    patches: [&[Patch]; 2],
    cup: &Cup,
    options: &PlanOptions,
) -> Correspondences {
    let fold = options.search.fold.cos();
    let mut possible: Vec<(usize, usize, f64, Guess)> = Vec::new();
    for (i, a) in patches[0].iter().enumerate() {
        let compared = |(j, b)| compare(views, [a, b], options).map(|(cost, guess)| (i, j, cost, guess));
        let mut own: Vec<_> = patches[1].iter().enumerate().filter_map(compared).collect();
        own.sort_by(|a, b| a.2.total_cmp(&b.2));
        possible.extend(own.into_iter().take(COMPARED));
    }
    let mut shown = [0, 1].map(|view: usize| all_shown(&views[view], patches[view], fold));
    let compared = possible.into_par_iter().filter_map(|(i, j, cost, guess)| {
        let surface = Surface::of_pair(views, [&shown[0][i], &shown[1][j]], &guess, cup, fold)?;
        let mismatch = surface.offset.map_or(1.0, |offset| offset.mismatch);
        Some((i, j, cost + mismatch / options.matching.mismatch, surface))
    });
    let mut compared: Vec<_> = compared.collect();
    compared.sort_by(|a, b| a.2.total_cmp(&b.2));
    let mut taken = patches.map(|patches| vec![false; patches.len()]);
    let mut pairs = Vec::new();
    for (i, j, _, surface) in compared {
        if !taken[0][i] && !taken[1][j] {
            taken[0][i] = true;
            taken[1][j] = true;
            pairs.push(surface);
        }
    }
    let mut single = Vec::new();
    for view in 0..2 {
        let left = std::mem::take(&mut shown[view]).into_iter().zip(&taken[view]);
        single.extend(left.filter(|(_, taken)| !**taken).map(|(shown, _)| (view, shown)));
    }
    Correspondences { pairs, single }
}

/// Patches with the pixels that are their own, in their order.
pub(crate) fn all_shown(view: &View<'_>, patches: &[Patch], fold: f64) -> Vec<Shown> {
    patches.par_iter().map(|patch| Shown::new(view, *patch, fold)).collect()
}

/// Cost of taking two patches for one, and where that one would be; none where something speaks against it.
fn compare(views: &[View<'_>], patches: [&Patch; 2], options: &PlanOptions) -> Option<(f64, Guess)> {
    let [a, b] = patches;
    let limits = &options.matching;
    let angle = a.normal.dot(&b.normal).clamp(-1.0, 1.0).acos();
    if angle > limits.normal_angle {
        return None;
    }
    let normal = (a.normal + b.normal).normalize();
    let found = triangulate([&views[0], &views[1]], [a.middle, b.middle])?;
    let smaller = a.axes[1].min(b.axes[1]);
    let allowed = limits.epipolar_px + limits.epipolar_share * smaller;
    let seen = place_by_depth(views, patches);
    // Of two that contradict each other one is wrong, and their middle as well.
    let agreed = seen.filter(|(_, apart)| *apart <= RANGE_BY_DEPTH);
    let point = agreed.map_or(found.point, |(point, _)| point);
    let ratio = area_ratio(views, patches, &point, &normal)?;
    let height = point.z - options.table_height;
    let is_possible = found.epipolar_px <= allowed
        && ratio <= limits.area_ratio
        && (-BELOW_TABLE..=options.highest).contains(&height)
        && seen.is_none_or(|(_, apart)| apart <= SAME_PLACE)
        && views
            .iter()
            .all(|view| view.facing(&point, &normal) >= options.limits.facing);
    let cost = (angle / limits.normal_angle).powi(2)
        + (found.epipolar_px / allowed).powi(2)
        + (ratio.ln() / limits.area_ratio.max(1.01).ln()).powi(2)
        + seen.map_or(0.0, |(_, apart)| (apart / SAME_PLACE).powi(2));
    let guess = Guess {
        point,
        normal,
        epipolar_px: found.epipolar_px,
        range: if agreed.is_some() {
            RANGE_BY_DEPTH
        } else {
            RANGE_BY_RAYS
        },
    };
    is_possible.then_some((cost, guess))
}

/// Where both views' depths say the patch is, and how far they are apart.
fn place_by_depth(views: &[View<'_>], patches: [&Patch; 2]) -> Option<(Point3<f64>, f64)> {
    let at = |k: usize| {
        let depth = views[k].depth_near(&patches[k].middle, DEPTH_REACH)?;
        Some(views[k].ray(&patches[k].middle)?.at(depth))
    };
    let (a, b) = (at(0)?, at(1)?);
    Some((Point3::from((a.coords + b.coords) / 2.0), (a - b).norm()))
}

/// Of the larger to the smaller, on the surface.
fn area_ratio(views: &[View<'_>], patches: [&Patch; 2], point: &Point3<f64>, normal: &Vector3<f64>) -> Option<f64> {
    let area = |k: usize| {
        let [focal, _] = views[k].input.camera.focal();
        let distance = (point - views[k].centre).norm();
        let facing = views[k].facing(point, normal);
        (facing > 0.0).then(|| patches[k].mass * (distance / focal).powi(2) / facing)
    };
    let ratio = area(0)? / area(1)?;
    Some(ratio.max(1.0 / ratio))
}
