//! Light that comes straight from the panels.

use std::array::from_fn;

use geometry::nalgebra::{Point3, Vector3};

use super::random::evenly;
use super::stage::{Place, Stage};

/// Places on a panel's rim, as shares of its sides, corners first: a shadow that begins hides one of them first, and one
/// that ends leaves one of them last.
const RIM: [[f64; 2]; 8] = [
    [0.0, 0.0],
    [1.0, 1.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [0.5, 0.0],
    [0.5, 1.0],
    [1.0, 0.5],
    [0.0, 0.5],
];

/// Points below the horizon send no light and get no ray; so many times the rays are tried before giving up.
const TRIES: usize = 3;
/// Where few rays disagree, at least this many more decide.
const LEAST_MORE: usize = 8;

/// How many rays look for the shadow of a panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShadowRays {
    /// To the panel's rim, at most 8: they find penumbrae and count for nothing else.
    pub(super) rim: usize,
    /// Always; where all agree so far, that is the answer.
    pub(super) few: usize,
    /// Where they do not.
    pub(super) many: usize,
}

impl ShadowRays {
    /// For a panel that gives this part of the brightest one's light: what errs there is seen less.
    fn for_part(self, part: f64) -> Self {
        let many = (self.many as f64 * part).ceil() as usize;
        Self {
            many: many.max(self.few + LEAST_MORE),
            ..self
        }
    }
}

/// A patch that light falls on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch<'a> {
    /// The ways it faces.
    pub(super) facings: &'a [Facing],
    /// Where shadow rays start, in turn.
    pub(super) origins: &'a [Origin],
    /// Moves the pattern of shadow rays; neighbours with the same one err alike.
    pub(super) shift: [f64; 2],
}

impl Patch<'_> {
    /// One of the origins; any few in a row are spread over all of them.
    fn origin(&self, index: usize) -> &Origin {
        let share = (index as f64 * 0.618_033_988_749_894_9).fract();
        &self.origins[(share * self.origins.len() as f64) as usize]
    }
}

/// A part of a patch that faces one way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facing {
    pub(super) point: Point3<f64>,
    /// Mean normal, times its share of the patch.
    pub(super) normal: Vector3<f64>,
}

/// A place where a shadow ray starts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    /// A little above the surface.
    pub(super) point: Point3<f64>,
    pub(super) normal: Vector3<f64>,
}

impl Facing {
    pub(super) fn of(place: &Place) -> Self {
        let Place { point, normal, .. } = *place;
        Self { point, normal }
    }
}

impl Origin {
    pub(super) fn of(place: &Place) -> Self {
        Self {
            point: place.lifted(),
            normal: place.normal,
        }
    }

    /// It alone as a whole patch.
    pub(super) fn facing(&self) -> Facing {
        let Self { point, normal } = *self;
        Facing { point, normal }
    }
}

/// By panel, how much of its light above the horizon arrives, 0..=1; NaN where that is not known.
pub(super) type Shares = [f64; 7];

/// Nothing is known.
pub(super) const UNKNOWN: Shares = [f64::NAN; 7];

/// Irradiance by each panel, in the panels' unit of radiance.
pub(super) fn direct_light(stage: &Stage<'_>, patch: &Patch<'_>, rays: ShadowRays) -> [f64; 7] {
    partly_known(stage, patch, &UNKNOWN, rays)
}

/// The same; only the shares that are not known are looked for, with fewer rays for panels that give little light.
pub(super) fn partly_known(stage: &Stage<'_>, patch: &Patch<'_>, shares: &Shares, rays: ShadowRays) -> [f64; 7] {
    let open: [f64; 7] = from_fn(|panel| open_light(stage, patch, panel));
    let brightest = open.iter().fold(0.0, |a: f64, &b| a.max(b));
    from_fn(|panel| match shares[panel] {
        _ if open[panel] <= 0.0 => 0.0,
        share if share.is_nan() => {
            let rays = rays.for_part(open[panel] / brightest);
            open[panel] * visible_share(stage, patch, panel, rays)
        }
        share => open[panel] * share,
    })
}

/// By panel, how much of its light above the horizon arrives; NaN where nothing would.
pub(super) fn shares(stage: &Stage<'_>, patch: &Patch<'_>, rays: ShadowRays) -> Shares {
    from_fn(|panel| {
        let open = open_light(stage, patch, panel);
        if open > 0.0 {
            visible_share(stage, patch, panel, rays)
        } else {
            f64::NAN
        }
    })
}

/// Irradiance if nothing stood between.
fn open_light(stage: &Stage<'_>, patch: &Patch<'_>, panel: usize) -> f64 {
    let panel = &stage.scene.panels[panel];
    let facings = patch.facings.iter();
    facings
        .map(|facing| panel.irradiance(&facing.point, &facing.normal))
        .sum()
}

/// How much of the light of a panel above the horizon arrives: rays to an even pattern of points on it, each weighted by
/// the light it would carry.
fn visible_share(stage: &Stage<'_>, patch: &Patch<'_>, panel: usize, rays: ShadowRays) -> f64 {
    let blockers = stage.blockers(&patch.origins[0].point, panel);
    let (mut all, mut open) = (0.0, 0.0);
    let [mut seen, mut hidden] = rim(stage, patch, panel, rays.rim);
    let mut sent = 0;
    for index in 0..TRIES * rays.many {
        if sent >= rays.many || (sent >= rays.few && seen != hidden) {
            break;
        }
        let target = panel_point(stage, panel, evenly(index, patch.shift));
        let origin = patch.origin(index);
        let weight = transport(stage, origin, panel, &target);
        if weight <= 0.0 {
            continue;
        }
        sent += 1;
        all += weight;
        if stage.blocked(&origin.point, &target, blockers) {
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
fn rim(stage: &Stage<'_>, patch: &Patch<'_>, panel: usize, rays: usize) -> [bool; 2] {
    let (origin, blockers) = (&patch.origins[0], stage.blockers(&patch.origins[0].point, panel));
    let mut found = [false; 2];
    for place in RIM.into_iter().take(rays) {
        let target = panel_point(stage, panel, place);
        if transport(stage, origin, panel, &target) > 0.0 {
            found[usize::from(stage.blocked(&origin.point, &target, blockers))] = true;
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
fn transport(stage: &Stage<'_>, origin: &Origin, panel: usize, target: &Point3<f64>) -> f64 {
    let way = target - origin.point;
    let here = origin.normal.dot(&way).max(0.0);
    let there = (-stage.scene.panels[panel].facing.dot(&way)).max(0.0);
    here * there / way.norm_squared().powi(2)
}
