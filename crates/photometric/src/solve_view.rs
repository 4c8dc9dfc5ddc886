//! From a capture to normals and depth, in one call.

use crate::depth::{DepthMap, IntegrationInput, IntegrationOptions, integrate};
use crate::error::PhotometricError;
use crate::near_field::{NearFieldOptions, near_field_normals};
use crate::object_mask::{ObjectMaskOptions, object_mask};
use crate::solution::{Capture, NormalSolution};

/// Options of every step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveOptions {
    /// Which pixels are looked at.
    pub mask: ObjectMaskOptions,
    /// How normals are found.
    pub normals: NearFieldOptions,
    /// How depth is found.
    pub depth: IntegrationOptions,
    /// Times that normals are solved again with the depth found before; the first pass takes the surface to be half a
    /// usual object's height over the table.
    pub feedback: usize,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            mask: ObjectMaskOptions::default(),
            normals: NearFieldOptions::default(),
            depth: IntegrationOptions::default(),
            feedback: 1,
        }
    }
}

/// What one view says of the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewSolution {
    /// Normals and how good they are.
    pub normals: NormalSolution,
    /// Depth of the same pixels.
    pub depth: DepthMap,
}

/// Finds the object, its normals and its depth.
///
/// # Errors
/// Those of [`object_mask`], [`near_field_normals`] and [`integrate`].
pub fn solve_view(capture: &Capture<'_>, options: &SolveOptions) -> Result<ViewSolution, PhotometricError> {
    let mask = object_mask(capture, &options.mask)?;
    let mut normals = near_field_normals(capture, &mask, None, &options.normals)?;
    let mut depth = depth_of(capture, &normals, options)?;
    for _ in 0..options.feedback {
        normals = near_field_normals(capture, &mask, Some(&depth.depth), &options.normals)?;
        depth = depth_of(capture, &normals, options)?;
    }
    Ok(ViewSolution { normals, depth })
}

fn depth_of(
    capture: &Capture<'_>,
    normals: &NormalSolution,
    options: &SolveOptions,
) -> Result<DepthMap, PhotometricError> {
    let input = IntegrationInput {
        normals: &normals.normals,
        confidence: &normals.confidence,
        mask: &normals.mask,
        view: capture.view,
        rays: capture.rays,
    };
    integrate(&input, &options.depth)
}
