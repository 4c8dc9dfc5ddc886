//! From views to ranked grasps.

use geometry::nalgebra::Vector3;
use rayon::prelude::*;

use crate::assess::Bench;
use crate::carried::Objects;
use crate::correspondence::{Correspondences, all_shown, correspond};
use crate::cup::Cup;
use crate::directions::orientations;
use crate::error::GraspError;
use crate::options::PlanOptions;
use crate::patch::{Found, find_patches, least_share};
use crate::rank::ranked;
use crate::refusal::{Failure, Refused, Test};
use crate::result::Plan;
use crate::seat::seat;
use crate::stem::SurfacePoints;
use crate::surface::{Shown, Surface};
use crate::view::{DEPTH_REACH, View, ViewInput};

/// An object that comes nearer to the image's border may go on beyond it, pixels.
const WHOLE: f64 = 3.0;

/// Finds where a cup can hold a solid object.
///
/// One view or two, in any order; results are the same on any number of threads. That nothing can be grasped is no error:
/// the plan then says why.
///
/// # Errors
/// No view or more than two; images of another size than the camera's; a camera below the table; numbers out of range.
pub fn plan(inputs: &[ViewInput<'_>], cup: &Cup, options: &PlanOptions) -> Result<Plan, GraspError> {
    let directions = options.unit_directions()?;
    let mut views = prepare(inputs, cup, options)?;
    let orientations = orientations(&directions, &options.search);
    let mut refused = Vec::new();
    let found: Vec<Found> = views
        .par_iter()
        .map(|view| patches_of(view, &orientations, cup, options))
        .collect();
    for (view, found) in found.iter().enumerate() {
        refused.extend(nothing_there(&views[view], view, found, cup, options));
    }
    let Correspondences { pairs, single } = matched(&views, &found, cup, options);
    seat(&mut views, &pairs, &options.matching);
    let mut surfaces = pairs;
    for (view, shown) in single {
        match by_depth(&views, view, &shown, cup, options) {
            Ok(surface) => surfaces.push(surface),
            Err(refusal) => refused.push(*refusal),
        }
    }
    let points: Vec<SurfacePoints> = views.iter().map(SurfacePoints::new).collect();
    let objects: Vec<Objects> = views.iter().map(Objects::new).collect();
    let bench = Bench {
        views: &views,
        points: &points,
        objects: &objects,
        directions: &directions,
        cup,
        options,
    };
    let assessed: Vec<_> = surfaces.par_iter().map(|surface| bench.assess(surface)).collect();
    let mut grasps = Vec::new();
    for result in assessed {
        match result {
            Ok(grasp) => grasps.push(grasp),
            Err(refusal) => refused.push(*refusal),
        }
    }
    Ok(Plan {
        grasps: ranked(grasps, cup),
        refused,
        views: views.len(),
    })
}

/// Checks everything and makes the views ready.
pub(crate) fn prepare<'a>(
    inputs: &[ViewInput<'a>],
    cup: &Cup,
    options: &PlanOptions,
) -> Result<Vec<View<'a>>, GraspError> {
    cup.check()?;
    options.check()?;
    if !(1..=2).contains(&inputs.len()) {
        return Err(GraspError::Views { found: inputs.len() });
    }
    inputs.par_iter().map(|input| View::new(input, cup, options)).collect()
}

fn patches_of(view: &View<'_>, orientations: &[Vector3<f64>], cup: &Cup, options: &PlanOptions) -> Found {
    let distance = view.distance_to_table(options.table_height);
    find_patches(view, orientations, cup, distance, &options.search)
}

/// Why a view has no patch, if it has none.
fn nothing_there(view: &View<'_>, number: usize, found: &Found, cup: &Cup, options: &PlanOptions) -> Option<Refused> {
    let [focal, _] = view.input.camera.focal();
    let radius = cup.radius() * focal / view.distance_to_table(options.table_height);
    let needed = (least_share() * std::f64::consts::PI * radius * radius).ceil();
    let limits = &options.limits;
    // As in a footprint: pixels of edges, as wide as edges count, over the object's pixels.
    let edges: f64 = view.edges.iter().map(|edge| f64::from(edge.weight)).sum();
    let edge_share = edges * limits.edge_width * radius / cup.radius() / (view.level.mask_pixels as f64).max(1.0);
    let is_empty = found.patches.is_empty();
    let failure = Failure::below(Test::ObjectPixels, view.level.mask_pixels as f64, needed)
        .or_else(|| Failure::above(Test::EdgeShare, edge_share, limits.edge_share).filter(|_| is_empty))
        .or_else(|| Failure::below(Test::FacingSurface, found.share, least_share()).filter(|_| is_empty));
    Some(Refused {
        views: vec![number],
        pixel: None,
        contact: None,
        normal: None,
        failures: vec![failure?],
    })
}

fn matched(views: &[View<'_>], found: &[Found], cup: &Cup, options: &PlanOptions) -> Correspondences {
    if let [a, b] = found {
        return correspond(views, [&a.patches, &b.patches], cup, options);
    }
    let fold = options.search.fold.cos();
    let shown = views
        .iter()
        .zip(found)
        .flat_map(|(view, found)| all_shown(view, &found.patches, fold));
    Correspondences {
        pairs: Vec::new(),
        single: shown.map(|shown| (0, shown)).collect(),
    }
}

fn by_depth(
    views: &[View<'_>],
    view: usize,
    shown: &Shown,
    cup: &Cup,
    options: &PlanOptions,
) -> Result<Surface, Box<Refused>> {
    let refused = |failure| {
        Box::new(Refused {
            views: vec![view],
            pixel: Some(shown.patch.middle),
            contact: None,
            normal: Some(shown.patch.normal),
            failures: vec![failure],
        })
    };
    let rim = views[view].rim_of(shown.patch.object);
    if let Some(failure) = Failure::below(Test::Cut, rim, WHOLE) {
        return Err(refused(failure));
    }
    let depth = views[view].depth_near(&shown.patch.inside, DEPTH_REACH);
    let fold = options.search.fold.cos();
    let surface = depth.and_then(|depth| Surface::of_view(views, view, shown, depth, cup, fold));
    surface.ok_or_else(|| {
        refused(Failure {
            test: Test::Depth,
            value: 0.0,
            allowed: 1.0,
        })
    })
}
