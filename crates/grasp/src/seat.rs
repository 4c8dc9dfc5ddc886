//! Integrated depth, put right where both views tell it.
//!
//! Each object's depth is integrated by itself and stood on the table. A view from straight above sees hardly a flank and
//! may take the top of a block for a sheet, so that the whole object's depth is wrong by one length. A patch that both
//! views show tells it.

use crate::options::MatchOptions;
use crate::patch::Patch;
use crate::surface::Surface;
use crate::view::{DEPTH_REACH, View};

/// Moves each object's depth, in each view, so that the largest patch which both views show lies where they show it.
pub(crate) fn seat(views: &mut [View<'_>], pairs: &[Surface], matching: &MatchOptions) {
    let is_sure = |surface: &Surface| surface.offset.is_some_and(|pair| pair.mismatch <= matching.mismatch);
    let mut largest_last: Vec<&Surface> = pairs.iter().filter(|surface| is_sure(surface)).collect();
    largest_last.sort_by(|a, b| a.area.total_cmp(&b.area));
    for surface in largest_last {
        for (&view, patch) in surface.views.iter().zip(&surface.patches) {
            if let Some(by) = offset(&views[view], surface, patch) {
                views[view].move_depth(patch.object, by);
            }
        }
    }
}

/// How much deeper a patch is than a view has it so far, along the optical axis, metres.
fn offset(view: &View<'_>, surface: &Surface, patch: &Patch) -> Option<f64> {
    let ray = view.ray(&patch.inside)?;
    let (origin, normal) = (surface.tangent.origin, surface.tangent.normal);
    let depth = normal.dot(&(origin - ray.origin)) / normal.dot(&ray.direction);
    let known = view.depth_near(&patch.inside, DEPTH_REACH)?;
    (depth > 0.0 && depth.is_finite()).then_some(depth - known)
}
