//! Light that comes straight from the panels.

use std::array::from_fn;

use geometry::nalgebra::{Point3, Vector3};

use super::random::evenly;
use super::stage::{Blockers, Stage};

/// Places on a panel's rim, as shares of its sides: a shadow that begins hides one of them first, and one that ends
/// leaves one of them last.
const RIM: [[f64; 2]; 8] = [
    [0.0, 0.0],
    [0.5, 0.0],
    [1.0, 0.0],
    [1.0, 0.5],
    [1.0, 1.0],
    [0.5, 1.0],
    [0.0, 1.0],
    [0.0, 0.5],
];

/// How many rays look for the shadow of a panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShadowRays {
    /// Always; where they agree, that is the answer.
    pub(super) few: usize,
    /// Where they do not.
    pub(super) many: usize,
}

/// A patch that light falls on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch<'a> {
    pub(super) point: Point3<f64>,
    /// Mean normal; may be a little shorter than 1 when the patch is not flat.
    pub(super) normal: Vector3<f64>,
    /// Points of it, a little above the surface; shadow rays start at them in turn.
    pub(super) origins: &'a [Point3<f64>],
    /// Moves the pattern of shadow rays; neighbours with the same one err alike.
    pub(super) shift: [f64; 2],
}

/// Irradiance by each panel, in the panels' unit of radiance.
pub(super) fn direct_light(stage: &Stage<'_>, patch: &Patch<'_>, rays: ShadowRays) -> [f64; 7] {
    from_fn(|panel| {
        let open = stage.scene.panels[panel].irradiance(&patch.point, &patch.normal);
        if open > 0.0 {
            open * visible_share(stage, patch, panel, rays)
        } else {
            0.0
        }
    })
}

/// How much of the light of a panel above the horizon arrives: rays to an even pattern of points on it, each weighted by
/// the light it would carry.
fn visible_share(stage: &Stage<'_>, patch: &Patch<'_>, panel: usize, rays: ShadowRays) -> f64 {
    let blockers = stage.blockers(&patch.point, panel);
    let (mut all, mut open) = (0.0, 0.0);
    let [mut seen, mut hidden] = rim(stage, patch, panel, blockers);
    for index in 0..rays.many {
        if index >= rays.few && seen != hidden {
            break;
        }
        let target = panel_point(stage, panel, evenly(index, patch.shift));
        let weight = transport(stage, patch, panel, &target);
        if weight <= 0.0 {
            continue;
        }
        all += weight;
        let origin = patch.origins[index % patch.origins.len()];
        if stage.blocked(&origin, &target, blockers) {
            hidden = true;
        } else {
            seen = true;
            open += weight;
        }
    }
    // A sliver above the horizon that no ray found is taken as open: it carries next to nothing.
    if all > 0.0 { open / all } else { 1.0 }
}

/// Whether some of a panel's rim above the horizon is seen, and whether some is hidden.
fn rim(stage: &Stage<'_>, patch: &Patch<'_>, panel: usize, blockers: Blockers) -> [bool; 2] {
    let mut found = [false; 2];
    for place in RIM {
        let target = panel_point(stage, panel, place);
        if transport(stage, patch, panel, &target) > 0.0 {
            found[usize::from(stage.blocked(&patch.origins[0], &target, blockers))] = true;
        }
    }
    found
}

fn panel_point(stage: &Stage<'_>, panel: usize, [along, across]: [f64; 2]) -> Point3<f64> {
    let panel = &stage.scene.panels[panel];
    let up = panel.facing.cross(&panel.right);
    let (right, size) = (panel.right.into_inner(), panel.size);
    panel.centre + right * ((along - 0.5) * size[0]) + up * ((across - 0.5) * size[1])
}

/// Light carried from a point on a panel, up to a common factor.
fn transport(stage: &Stage<'_>, patch: &Patch<'_>, panel: usize, target: &Point3<f64>) -> f64 {
    let way = target - patch.point;
    let here = patch.normal.dot(&way).max(0.0);
    let there = (-stage.scene.panels[panel].facing.dot(&way)).max(0.0);
    here * there / way.norm_squared().powi(2)
}
