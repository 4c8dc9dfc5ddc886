//! A patch in space: a plane that bends a little, as one or two views show it.

use geometry::nalgebra::{Point3, Vector3};

use crate::align::{Offset, Sweep, best_offset};
use crate::chart::{Bend, Chart, Grid, Part, Tangent};
use crate::cup::Cup;
use crate::distance::squared_distances;
use crate::patch::Patch;
use crate::region::Region;
use crate::view::View;

/// Cells from the middle of a patch's chart to its border.
const HALF: usize = 32;
/// A patch's chart goes this much beyond its ellipse, and this many metres: borders tell where it is.
const BEYOND: f64 = 1.25;
const BEYOND_BY: f64 = 0.004;
const COARSE: Sweep = Sweep {
    middle: 0.0,
    range: 0.0,
    step: 0.001,
    stride: 4,
};
const FINE: Sweep = Sweep {
    middle: 0.0,
    range: 0.0012,
    step: 0.0003,
    stride: 2,
};
/// A view's normal of a patch may be this far off the mean of both, radians: the patch is grown by as much more, and cut
/// about the mean.
const OWN_NORMAL: f64 = 0.1;
/// Charts this near to the surface need not be made anew, metres.
const NEAR: f64 = 0.0025;
/// Clearances beyond this many radii make no place better.
const ENOUGH: f64 = 1.5;

/// A patch in space.
#[derive(Debug)]
pub(crate) struct Surface {
    /// Positions of the views.
    pub(crate) views: Vec<usize>,
    /// Where each of them shows the patch.
    pub(crate) patches: Vec<Patch>,
    pub(crate) tangent: Tangent,
    pub(crate) bend: Bend,
    /// One for each of the views.
    pub(crate) charts: Vec<Chart>,
    pub(crate) offset: Option<Offset>,
    pub(crate) epipolar_px: f64,
    /// Square metres.
    pub(crate) area: f64,
}

/// A patch with the pixels that are its own.
#[derive(Debug)]
pub(crate) struct Shown {
    pub(crate) patch: Patch,
    pub(crate) region: Region,
}

impl Shown {
    pub(crate) fn new(view: &View<'_>, patch: Patch, fold: f64) -> Self {
        let region = Region::grow(&view.fine, &patch, (fold.acos() + OWN_NORMAL).cos());
        Self { patch, region }
    }
}

/// A place on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) point: Point3<f64>,
    pub(crate) normal: Vector3<f64>,
}

/// Where a pair is thought to be, before its charts are compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Guess {
    pub(crate) point: Point3<f64>,
    pub(crate) normal: Vector3<f64>,
    pub(crate) epipolar_px: f64,
    /// Heights to both sides that are looked at, metres.
    pub(crate) range: f64,
}

impl Surface {
    /// A patch of two views: charts about a guess are swept; when they are far from what is found, so are charts there.
    /// None where no height within the range is best.
    pub(crate) fn of_pair(views: &[View<'_>], shown: [&Shown; 2], guess: &Guess, cup: &Cup, fold: f64) -> Option<Self> {
        let patches = shown.map(|shown| shown.patch);
        let grid = grid(&[&views[0], &views[1]], &patches, &guess.point, cup);
        let at = |tangent: Tangent| Self::on(views, &[(0, shown[0]), (1, shown[1])], tangent, grid, fold);
        let mut surface = at(Tangent::new(guess.point, guess.normal));
        let mut offset = surface.swept(guess.range)?;
        if offset.height.abs() > NEAR {
            surface = at(surface.tangent.moved(offset.height));
            offset = surface.swept(NEAR)?;
        }
        surface.tangent = surface.tangent.moved(offset.height);
        surface.offset = Some(offset);
        surface.epipolar_px = guess.epipolar_px;
        Some(surface)
    }

    /// A coarse sweep and a fine one about its best height.
    fn swept(&self, range: f64) -> Option<Offset> {
        let [a, b] = self.charts.as_slice() else { return None };
        let (a, b) = (a.blurred(), b.blurred());
        let coarse = Sweep {
            middle: 0.0,
            range,
            ..COARSE
        };
        let middle = best_offset(&a, &b, &self.bend, &coarse)?.height;
        best_offset(&a, &b, &self.bend, &Sweep { middle, ..FINE })
    }

    /// A patch of one view at a known depth.
    pub(crate) fn of_view(
        views: &[View<'_>],
        view: usize,
        shown: &Shown,
        depth: f64,
        cup: &Cup,
        fold: f64,
    ) -> Option<Self> {
        let point = views[view].ray(&shown.patch.inside)?.at(depth);
        let grid = grid(&[&views[view]], &[shown.patch], &point, cup);
        let tangent = Tangent::new(point, shown.patch.normal);
        Some(Self::on(views, &[(view, shown)], tangent, grid, fold))
    }

    fn on(views: &[View<'_>], shown: &[(usize, &Shown)], tangent: Tangent, grid: Grid, fold: f64) -> Self {
        let chart = |&(view, shown): &(usize, &Shown)| {
            let part = Part {
                region: &shown.region,
                least_cosine: fold,
                seed: view as u64,
            };
            Chart::new(&views[view], tangent, grid, Some(part))
        };
        let charts: Vec<Chart> = shown.iter().map(chart).collect();
        let patches: Vec<Patch> = shown.iter().map(|(_, shown)| shown.patch).collect();
        let bend = Bend::fit(&charts.iter().collect::<Vec<_>>(), fold, grid.reach() / BEYOND);
        let areas = charts
            .iter()
            .zip(&patches)
            .map(|(chart, patch)| patch.mass / chart.density.max(1.0));
        let area = areas.fold(f64::INFINITY, f64::min);
        Self {
            views: shown.iter().map(|(view, _)| *view).collect(),
            patches,
            tangent,
            bend,
            charts,
            offset: None,
            epipolar_px: 0.0,
            area,
        }
    }

    /// The place that is farthest from where the patch ends, and among such places the one nearest to the patch's middle
    /// and to the object's centre of mass. Holes up to a speck's area (square metres) are taken for noise.
    pub(crate) fn best_place(&self, cup: &Cup, fold: f64, speck: f64, centre: &Point3<f64>) -> Place {
        let grid = self.charts[0].grid;
        let open: Vec<Vec<bool>> = self.charts.iter().map(|chart| chart.open(fold, speck)).collect();
        let patch = squared_distances(grid.side(), |index| open.iter().all(|open| open[index]));
        let radii = |squared: f32| f64::from(squared).sqrt() * grid.pitch / cup.radius();
        let level = |x: f64, y: f64| (self.tangent.at(x, y) - centre).xy().norm();
        let merit = |index: usize| {
            let [x, y] = grid.position(index);
            let away = 0.1 * x.hypot(y) + 0.1 * level(x, y);
            2.0 * radii(patch[index]).min(ENOUGH) - away / cup.radius()
        };
        let cells = 0..patch.len();
        let best = cells
            .filter(|&index| patch[index] > 0.0)
            .max_by(|&a, &b| merit(a).total_cmp(&merit(b)));
        let [x, y] = best.map_or([0.0; 2], |best| grid.position(best));
        self.place(x, y)
    }

    fn place(&self, x: f64, y: f64) -> Place {
        let Tangent { u, v, normal, .. } = self.tangent;
        let turned = self.bend.normal(x, y);
        Place {
            point: self.tangent.at(x, y) + normal * self.bend.height(x, y),
            normal: (u * turned.x + v * turned.y + normal * turned.z).normalize(),
        }
    }
}

/// Large enough for the larger view of the patch and for the cup.
fn grid(views: &[&View<'_>], patches: &[Patch], point: &Point3<f64>, cup: &Cup) -> Grid {
    let radius = |(view, patch): (&&View<'_>, &Patch)| {
        let scale = (point - view.centre).norm() / view.input.camera.focal()[0];
        let facing = view.facing(point, &patch.normal).max(0.3);
        // A patch is foreshortened along one direction only, but which one of its axes that is matters little here.
        (patch.axes[0] * scale).max(patch.axes[1] * scale / facing)
    };
    let radii = views.iter().zip(patches).map(radius);
    let extent = radii.fold(0.0, f64::max) * BEYOND + BEYOND_BY;
    Grid {
        pitch: extent.max(1.6 * cup.radius()) / HALF as f64,
        half: HALF,
    }
}
