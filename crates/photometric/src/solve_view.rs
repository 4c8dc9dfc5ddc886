//! From a capture to normals, depth and edges, in one call: a first look at half the size, then every pixel.

use imaging::{Image, Mask};

use crate::calibration::PolynomialRig;
use crate::depth::{DepthMap, IntegrationInput, IntegrationOptions, integrate};
use crate::error::PhotometricError;
use crate::half_size::{HalfSize, doubled};
use crate::near_field::{FirstLook, NearFieldOptions, Solved, near_field_normals, solve};
use crate::object_mask::{ObjectMaskOptions, object_mask};
use crate::occlusion_edges::{EdgeInput, EdgeMap, EdgeOptions, occlusion_edges};
use crate::reference::{ReferenceOptions, reference_normals};
use crate::solution::{Capture, NormalSolution};
use crate::window::Window;

/// Factors of a depth that stands on the table which the light is asked about: from 6 % farther to 30 % nearer, 0.1 m at
/// 0.33 m.
const FARTHEST: f32 = 1.06;
const SCALE_STEP: f32 = 0.03;
/// The light tells the scale to about a hundredth, a contact with the table that is seen far better: only when the light
/// says more than this is the contact not believed.
const TABLE_TRUST: f32 = 0.015;

/// Options of every step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SolveOptions {
    /// Which pixels are looked at.
    pub mask: ObjectMaskOptions,
    /// How normals are found.
    pub normals: NearFieldOptions,
    /// How depth is found.
    pub depth: IntegrationOptions,
    /// How depth edges are found.
    pub edges: EdgeOptions,
}

/// What one view says of the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSolution {
    /// Normals and how good they are.
    pub normals: NormalSolution,
    /// Depth of the same pixels.
    pub depth: DepthMap,
    /// Where one surface hides another.
    pub edges: EdgeMap,
}

/// Finds the object, its normals, its depth and its depth edges.
///
/// # Errors
/// Those of [`object_mask`], [`near_field_normals`], [`integrate`] and [`occlusion_edges`].
pub fn solve_view(capture: &Capture<'_>, options: &SolveOptions) -> Result<ViewSolution, PhotometricError> {
    let mask = object_mask(capture, &options.mask)?;
    let edges = edges_of(capture, &mask, &options.edges)?;
    let Some(window) = Window::around(capture, &mask) else {
        let normals = near_field_normals(capture, &mask, None, options.normals)?;
        let depth = depth_of(capture, &normals, &options.depth)?;
        return Ok(ViewSolution { normals, depth, edges });
    };
    let part = window.capture(capture);
    let solved = solve_part(&part, &window.mask, options)?;
    let normals = solved.solution(&part, &window.mask);
    let mut depth = depth_of(&part, &normals, &options.depth)?;
    depth.depth = rescaled(&part, &solved, depth.depth)?;
    Ok(ViewSolution {
        normals: window.whole_normals(&normals, &mask),
        depth: window.whole_depth(&depth, &mask),
        edges,
    })
}

/// The same with the published method's normals, as a yardstick: mask, depth and edges are ours.
///
/// # Errors
/// Those of [`solve_view`] and [`reference_normals`].
pub fn solve_view_by_reference(
    capture: &Capture<'_>,
    lights: &PolynomialRig,
    reference: &ReferenceOptions,
    options: &SolveOptions,
) -> Result<ViewSolution, PhotometricError> {
    let mask = object_mask(capture, &options.mask)?;
    let edges = edges_of(capture, &mask, &options.edges)?;
    let normals = reference_normals(capture, &mask, lights, reference)?;
    let depth = depth_of(capture, &normals, &options.depth)?;
    Ok(ViewSolution { normals, depth, edges })
}

/// The normals of [`solve_view`] alone: where panels are near, they need a rough depth, which is found on the way.
///
/// # Errors
/// Those of [`near_field_normals`] and [`integrate`].
pub fn solve_normals(
    capture: &Capture<'_>,
    mask: &Mask,
    options: &SolveOptions,
) -> Result<NormalSolution, PhotometricError> {
    let Some(window) = Window::around(capture, mask) else {
        return near_field_normals(capture, mask, None, options.normals);
    };
    let part = window.capture(capture);
    let normals = solve_part(&part, &window.mask, options)?.solution(&part, &window.mask);
    Ok(window.whole_normals(&normals, mask))
}

/// The first look at half the size tells where the surface is and what it throws on itself.
fn solve_part(capture: &Capture<'_>, mask: &Mask, options: &SolveOptions) -> Result<Solved, PhotometricError> {
    // A rough depth is enough: weights that follow discontinuities are for the second look.
    let rough = IntegrationOptions {
        rounds: 1,
        ..options.depth
    };
    let look = |capture: &Capture<'_>, mask: &Mask| {
        let solved = solve(capture, mask, None, None, options.normals)?;
        let depth = depth_of(capture, &solved.solution(capture, mask), &rough)?.depth;
        let depth = rescaled(capture, &solved, depth)?;
        Ok::<_, PhotometricError>((solved, depth))
    };
    let Some(half) = HalfSize::of(capture, mask) else {
        let (_, depth) = look(capture, mask)?;
        return solve(capture, mask, Some(&depth), None, options.normals);
    };
    let small = half.capture(capture);
    let (solved, depth) = look(&small, &half.mask)?;
    let first: FirstLook = solved.first_look(&small, &depth, options.normals)?;
    solve(capture, mask, Some(&doubled(&depth)), Some(&first), options.normals)
}

/// Depth as it is, or nearer where the light says that the object is not where it seems to touch the table.
fn rescaled(capture: &Capture<'_>, solved: &Solved, depth: Image<f32>) -> Result<Image<f32>, PhotometricError> {
    let scales: [f32; 13] = std::array::from_fn(|step| FARTHEST - step as f32 * SCALE_STEP);
    let found = solved.best_scale(capture, &depth, &scales)?;
    let nearer = found.filter(|scale| *scale < 1.0 - TABLE_TRUST);
    Ok(match nearer {
        Some(scale) => depth.map(|depth| depth * scale),
        None => depth,
    })
}

fn edges_of(capture: &Capture<'_>, mask: &Mask, options: &EdgeOptions) -> Result<EdgeMap, PhotometricError> {
    let input = EdgeInput {
        capture,
        mask: Some(mask),
        depth: None,
    };
    occlusion_edges(&input, options)
}

fn depth_of(
    capture: &Capture<'_>,
    normals: &NormalSolution,
    options: &IntegrationOptions,
) -> Result<DepthMap, PhotometricError> {
    let input = IntegrationInput {
        normals: &normals.normals,
        confidence: &normals.confidence,
        mask: &normals.mask,
        view: capture.view,
        rays: capture.rays,
    };
    integrate(&input, options)
}
