//! Thin objects, which shading alone does not tell from what they lie on: their outlines throw shadows.
//!
//! What hides something else is outlined by edges, whatever is printed on it. In each view the edges are laid out on the
//! table's plane and grouped; a group's smallest circle (or rectangle, or the centroid of its convex hull) gives its
//! middle. The middles of both views are triangulated, and the cup comes along the table's normal.

mod circle;
mod hull;
mod outline;

use geometry::nalgebra::{Matrix3, Point2, Point3, Vector3};
use rayon::prelude::*;

use crate::assess::Bench;
use crate::carried::Axis;
use crate::chart::{Chart, Grid, Tangent};
use crate::cup::Cup;
use crate::error::GraspError;
use crate::footprint::{Circle, Footprint};
use crate::options::PlanOptions;
use crate::plan::prepare;
use crate::rank::ranked;
use crate::refusal::{Failure, Refused, Test};
use crate::result::{Carried, Grasp, Measured, Plan, Source};
use crate::stem::SurfacePoints;
use crate::surface::Place;
use crate::triangulate::{covariance, covariance_at_depth, triangulate};
use crate::view::{DEPTH_REACH, View, ViewInput};
use outline::{Outline, outlines};

/// Outlines whose circle is smaller than this share of the cup's are specks, no candidates.
const SPECK: f64 = 0.5;
/// One object's circles differ by at most this ratio between views.
const SAME_RADIUS: f64 = 1.15;
/// A middle this far below the table is none, metres.
const BELOW_TABLE: f64 = 0.004;
/// Without depth a thin object's top is known this well from a single view, metres.
const SIGMA_HEIGHT: f64 = 0.003;
/// Cells of a footprint's chart across the cup's radius, and from its middle to its border.
const CELLS: f64 = 8.0;
const HALF: usize = 12;

/// Finds thin objects by their outlines, and where a cup can lift them.
///
/// One view or two. What lies on something else comes before it; otherwise the best first. With one view a middle is
/// taken at its integrated depth, or on the table.
///
/// # Errors
/// Those of [`plan`](crate::plan()).
pub fn plan_thin(inputs: &[ViewInput<'_>], cup: &Cup, options: &PlanOptions) -> Result<Plan, GraspError> {
    let directions = options.unit_directions()?;
    let views = prepare(inputs, cup, options)?;
    let found: Vec<Vec<Outline>> = views.par_iter().map(|view| candidates(view, cup, options)).collect();
    let points: Vec<SurfacePoints> = views.iter().map(SurfacePoints::new).collect();
    let bench = Bench {
        views: &views,
        points: &points,
        objects: &[],
        directions: &directions,
        cup,
        options,
    };
    let (things, mut refused) = match found.as_slice() {
        [a, b] => paired(&views, [a, b], options),
        _ => (
            found
                .iter()
                .flatten()
                .filter_map(|outline| alone(&views, outline, options))
                .collect(),
            Vec::new(),
        ),
    };
    refused.extend(
        found
            .iter()
            .enumerate()
            .filter_map(|(view, found)| nothing_found(view, found)),
    );
    let mut layers: Vec<(usize, Vec<Grasp>)> = Vec::new();
    for thing in &things {
        let carries = things
            .iter()
            .filter(|other| thing.outlines[0].encloses(other.outlines[0]))
            .count();
        match thing.assess(&bench) {
            Ok(grasp) => layers.push((carries, vec![grasp])),
            Err(refusal) => refused.push(*refusal),
        }
    }
    layers.sort_by_key(|(carries, _)| *carries);
    let same = layers.chunk_by(|a, b| a.0 == b.0);
    let grasps = same.flat_map(|layer| ranked(layer.iter().flat_map(|(_, grasps)| grasps.clone()).collect(), cup));
    Ok(Plan {
        grasps: grasps.collect(),
        refused,
        views: views.len(),
    })
}

/// An outline that one view or both show.
struct Thing<'a> {
    views: Vec<usize>,
    outlines: Vec<&'a Outline>,
    pixels: Vec<Point2<f64>>,
    /// Of its top.
    middle: Point3<f64>,
    covariance: Matrix3<f64>,
}

fn candidates(view: &View<'_>, cup: &Cup, options: &PlanOptions) -> Vec<Outline> {
    let mut found = outlines(view, options.table_height);
    found.retain(|outline| outline.circle.radius > SPECK * cup.radius());
    found
}

fn nothing_found(view: usize, found: &[Outline]) -> Option<Refused> {
    found.is_empty().then(|| Refused {
        views: vec![view],
        pixel: None,
        contact: None,
        normal: None,
        failures: vec![Failure {
            test: Test::Outlines,
            value: 0.0,
            allowed: 1.0,
        }],
    })
}

/// Outlines of one size whose middles meet, the best agreement first; what is left over is refused.
fn paired<'a>(views: &[View<'_>], found: [&'a [Outline]; 2], options: &PlanOptions) -> (Vec<Thing<'a>>, Vec<Refused>) {
    let mut possible: Vec<(f64, usize, usize, Thing<'a>)> = Vec::new();
    for (i, a) in found[0].iter().enumerate() {
        for (j, b) in found[1].iter().enumerate() {
            if let Some((cost, thing)) = together(views, [a, b], options) {
                possible.push((cost, i, j, thing));
            }
        }
    }
    possible.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken = found.map(|outlines| vec![false; outlines.len()]);
    let mut things = Vec::new();
    for (_, i, j, thing) in possible {
        if !taken[0][i] && !taken[1][j] {
            taken[0][i] = true;
            taken[1][j] = true;
            things.push(thing);
        }
    }
    let left = |view: usize| {
        let free = found[view].iter().zip(&taken[view]).filter(|(_, taken)| !**taken);
        free.map(move |(outline, _)| unpaired(&views[view], view, outline, options))
    };
    let refused = left(0).chain(left(1)).collect();
    (things, refused)
}

fn together<'a>(views: &[View<'_>], pair: [&'a Outline; 2], options: &PlanOptions) -> Option<(f64, Thing<'a>)> {
    let [a, b] = pair;
    let on_table = |outline: &Outline| Point3::new(outline.middle.x, outline.middle.y, options.table_height);
    let pixels = [views[0].project(&on_table(a))?, views[1].project(&on_table(b))?];
    let found = triangulate([&views[0], &views[1]], pixels)?;
    let height = found.point.z - options.table_height;
    // What is nearer to the camera than the table looks larger on it.
    let radius = |view: &View<'_>, outline: &Outline| {
        outline.circle.radius * (view.centre.z - found.point.z) / (view.centre.z - options.table_height)
    };
    let ratio = radius(&views[0], a) / radius(&views[1], b);
    let ratio = ratio.max(1.0 / ratio);
    let is_one = ratio < SAME_RADIUS
        && found.epipolar_px <= options.matching.epipolar_px
        && (-BELOW_TABLE..=options.highest).contains(&height);
    let covariance = covariance(&[&views[0], &views[1]], &found.point, options.matching.sigma_px)?;
    let cost = found.epipolar_px / options.matching.epipolar_px + ratio.ln() / SAME_RADIUS.ln();
    is_one.then(|| {
        let thing = Thing {
            views: vec![0, 1],
            outlines: pair.to_vec(),
            pixels: pixels.to_vec(),
            middle: found.point,
            covariance,
        };
        (cost, thing)
    })
}

fn alone<'a>(views: &[View<'_>], outline: &'a Outline, options: &PlanOptions) -> Option<Thing<'a>> {
    let view = &views[0];
    let on_table = Point3::new(outline.middle.x, outline.middle.y, options.table_height);
    let pixel = view.project(&on_table)?;
    let limits = &options.matching;
    let (middle, sigma) = match view.depth_near(&pixel, DEPTH_REACH) {
        Some(depth) => (view.ray(&pixel)?.at(depth), limits.sigma_depth),
        None => (on_table, SIGMA_HEIGHT.max(limits.sigma_depth)),
    };
    Some(Thing {
        views: vec![0],
        outlines: vec![outline],
        pixels: vec![pixel],
        middle,
        covariance: covariance_at_depth(view, &middle, limits.sigma_px, sigma)?,
    })
}

fn unpaired(view: &View<'_>, number: usize, outline: &Outline, options: &PlanOptions) -> Refused {
    let middle = Point3::new(outline.middle.x, outline.middle.y, options.table_height);
    let failure = Failure {
        test: Test::OutlinePair,
        value: 1.0,
        allowed: 2.0,
    };
    Refused {
        views: vec![number],
        pixel: view.project(&middle),
        contact: None,
        normal: None,
        failures: Failure::below(Test::Outline, outline.coverage, options.limits.outline)
            .into_iter()
            .chain([failure])
            .collect(),
    }
}

impl Thing<'_> {
    fn assess(&self, bench: &Bench<'_>) -> Result<Grasp, Box<Refused>> {
        let measured = self.measured(bench);
        let (limits, cup) = (&bench.options.limits, bench.cup);
        let coverage = self.coverage();
        let height = self.middle.z - bench.options.table_height;
        let place = Place {
            point: self.middle,
            normal: Vector3::z(),
        };
        let failures: Vec<Failure> = [
            Failure::below(Test::Outline, coverage, limits.outline),
            Failure::below(Test::Border, measured.border, cup.radius() + limits.border),
            Failure::above(Test::EdgeShare, measured.edge_share, limits.edge_share),
            Failure::above(Test::EdgeMoment, measured.edge_moment, limits.edge_moment),
            Failure::above(Test::Height, height, bench.options.highest),
            bench.blocked(&self.views, &place),
            Failure::above(Test::Uncertainty, measured.sigma, limits.uncertainty),
        ]
        .into_iter()
        .flatten()
        .collect();
        if failures.is_empty() {
            return Ok(self.grasp(bench, measured));
        }
        Err(Box::new(Refused {
            views: self.views.clone(),
            pixel: self.pixels.first().copied(),
            contact: Some(self.middle),
            normal: Some(Vector3::z()),
            failures,
        }))
    }

    fn grasp(&self, bench: &Bench<'_>, measured: Measured) -> Grasp {
        let scores = bench.scores(&measured);
        let pixels = self.views.iter().copied().zip(self.pixels.iter().copied());
        let radii = self.outlines.iter().map(|outline| outline.circle.radius);
        Grasp {
            contact: self.middle,
            covariance: self.covariance,
            normal: Vector3::z(),
            source: Source::Outline {
                pixels: pixels.collect(),
                radius: radii.fold(f64::INFINITY, f64::min),
                coverage: self.coverage(),
            },
            patch_radius: measured.border,
            carried: self.carried(bench),
            scores,
            measured,
            total: scores.total(&bench.options.weights),
        }
    }

    fn carried(&self, bench: &Bench<'_>) -> Carried {
        let axis = Axis {
            contact: self.middle,
            direction: -Vector3::z(),
            table_height: bench.options.table_height,
        };
        let radii = self.outlines.iter().map(|outline| outline.outer_radius());
        Carried::thin(&axis, radii.fold(0.0, f64::max))
    }

    fn coverage(&self) -> f64 {
        self.outlines.iter().map(|outline| outline.coverage).fold(1.0, f64::min)
    }

    /// Confidence is that of the outline: normals have no part in this.
    fn measured(&self, bench: &Bench<'_>) -> Measured {
        let circle = Circle {
            radius: bench.cup.radius(),
            edge_width: bench.options.limits.edge_width,
            fold: bench.options.search.fold.cos(),
        };
        let grid = Grid {
            pitch: bench.cup.radius() / CELLS,
            half: HALF,
        };
        let tangent = Tangent::new(self.middle, Vector3::z());
        let measure = |&view: &usize| Footprint::measure(&Chart::new(&bench.views[view], tangent, grid, None), &circle);
        let footprints: Vec<Footprint> = self.views.iter().map(measure).collect();
        let most = |value: fn(&Footprint) -> f64| footprints.iter().map(value).fold(0.0, f64::max);
        let least = |value: fn(&Outline) -> f64| {
            self.outlines
                .iter()
                .map(|outline| value(outline))
                .fold(f64::INFINITY, f64::min)
        };
        Measured {
            misalignment: crate::directions::misalignment(&Vector3::z(), bench.directions),
            area: least(|outline| outline.area),
            edge_share: most(|footprint| footprint.edge_share),
            edge_moment: most(|footprint| footprint.edge_moment),
            gap: 0.0,
            confidence: self.coverage(),
            border: least(Outline::inner_radius),
            from_centre: 0.0,
            sigma: self.covariance[(2, 2)].max(0.0).sqrt(),
        }
    }
}
