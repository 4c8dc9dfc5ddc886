//! Depth from normals: perspective integration that stops at depth discontinuities.
//!
//! The unknown is the logarithm u of the depth z. The plane through a pixel's point with its normal n meets the ray of
//! a neighbour where
//!
//! ```text
//! u_q - u_p = ln(n · r_p) - ln(n · r_q)
//! ```
//!
//! with the rays r at z = 1, which holds for any lens (Quéau, Durou and Aujol, "Normal integration: a survey", 2018,
//! write the same with a constant focal length). Each pixel says so of all four neighbours; where a neighbour lies
//! across a discontinuity its side is trusted less, by the one-sided weights of Cao et al., "Bilateral normal
//! integration" (ECCV 2022). Absolute depth comes from the table, on which the object stands.

mod anchor;
mod links;
mod multigrid;
mod points;

pub use points::{SurfacePoint, surface_points};

use imaging::{Image, Mask};

use crate::error::PhotometricError;
use crate::view::{PixelRays, View};

/// Normals to integrate.
#[derive(Debug, Clone, Copy)]
pub struct IntegrationInput<'a> {
    /// Unit vectors, base frame; NaN where none is known.
    pub normals: &'a Image<[f32; 3]>,
    /// 0 to 1; a pixel of confidence 0 says nothing of its neighbours' depth.
    pub confidence: &'a Image<f32>,
    /// Pixels that get a depth, as far as they have a normal.
    pub mask: &'a Mask,
    /// Camera and pose.
    pub view: &'a View,
    /// Of that camera.
    pub rays: &'a PixelRays,
}

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegrationOptions {
    /// How sharply one side wins over the other at a discontinuity; Cao et al. recommend 2 for distances in pixels.
    pub stiffness: f32,
    /// Times the weights are found anew.
    pub rounds: usize,
    /// Relative misfit at which a round is done.
    pub tolerance: f32,
}

impl Default for IntegrationOptions {
    fn default() -> Self {
        Self {
            stiffness: 2.0,
            rounds: 2,
            tolerance: 1e-3,
        }
    }
}

impl IntegrationOptions {
    fn check(&self) -> Result<(), PhotometricError> {
        let within = PhotometricError::require_within;
        within("stiffness", f64::from(self.stiffness), 0.0..=100.0, "0 to 100")?;
        within("rounds", self.rounds as f64, 0.0..=100.0, "0 to 100")?;
        within("tolerance", f64::from(self.tolerance), 1e-7..=0.5, "1e-7 to 0.5")
    }
}

/// Depth of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap {
    /// Along the optical axis, metres; NaN where there is none.
    pub depth: Image<f32>,
    /// Connected parts, each with a scale of its own from the table.
    pub parts: usize,
    /// Steps of the solver, over all rounds.
    pub iterations: usize,
}

/// Integrates a normal map. Pixels without a normal, and parts that are not seen to stand on the table, get NaN.
///
/// # Errors
/// Images or rays of another size than the view's; options out of range.
pub fn integrate(input: &IntegrationInput<'_>, options: &IntegrationOptions) -> Result<DepthMap, PhotometricError> {
    options.check()?;
    check(input)?;
    let surface = links::Surface::new(input);
    let (mut log_depth, mut iterations) = (surface.flat(), 0);
    for round in 0..options.rounds.max(1) {
        let stiffness = if round == 0 { 0.0 } else { options.stiffness };
        let system = surface.system(&log_depth, stiffness);
        iterations += multigrid::solve(&system, &mut log_depth, options.tolerance);
    }
    let (depth, parts) = anchor::to_table(input, &surface, &log_depth);
    Ok(DepthMap {
        depth,
        parts,
        iterations,
    })
}

fn check(input: &IntegrationInput<'_>) -> Result<(), PhotometricError> {
    input.view.require_rays(input.rays)?;
    let (width, height) = (input.view.camera.width(), input.view.camera.height());
    let sizes = [
        ("the normals", input.normals.width(), input.normals.height()),
        ("the confidences", input.confidence.width(), input.confidence.height()),
        (
            "the mask",
            input.mask.as_image().width(),
            input.mask.as_image().height(),
        ),
    ];
    let other = sizes.into_iter().find(|&(_, w, h)| (w, h) != (width, height));
    other.map_or(Ok(()), |(what, w, h)| {
        Err(PhotometricError::OtherSize {
            what,
            width: w,
            height: h,
            expected_width: width,
            expected_height: height,
        })
    })
}
