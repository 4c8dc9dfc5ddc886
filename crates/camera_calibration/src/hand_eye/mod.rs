//! Where a camera is on the arm, or over the table, from pictures of the target and the arm's poses.
//!
//! A closed form gives a start, then the distances of all corners in all images are made smallest, with an arm that is a
//! little off at every stand. The lens is known.

mod arm_slack;
mod closed_form;
mod fit;
mod in_hand;
mod to_hand;

use geometry::RigidTransform;

use crate::checks::Shortfall;
use crate::detect::DetectedCorner;
use crate::stereo::Placed;
use crate::views::{self, ViewReport};

pub use in_hand::{EyeInHand, SceneCamera, SceneView, calibrate_eye_in_hand};
pub use to_hand::{EyeToHand, calibrate_eye_to_hand};

/// The target in an image, and where the arm was.
#[derive(Debug, Clone, PartialEq)]
pub struct HandEyeView {
    /// What people call the image.
    pub name: String,
    /// The flange's pose when it was taken.
    pub base_from_flange: RigidTransform,
    /// As found.
    pub corners: Vec<DetectedCorner>,
    /// Eye in hand: at which of its places the target stood; elsewhere without meaning.
    pub placement: usize,
}

/// What a calibration has to reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandEyeThresholds {
    /// Fewest views.
    pub views: usize,
    /// Least turn of the flange about its second axis, radians.
    pub turn: f64,
    /// Most root mean square distance on the target between where arm and camera see it, metres.
    pub place: f64,
    /// Most standard deviation of the pose's translation, metres.
    pub deviation: f64,
}

impl Default for HandEyeThresholds {
    fn default() -> Self {
        Self {
            views: 8,
            turn: 20_f64.to_radians(),
            place: 1e-3,
            deviation: 0.5e-3,
        }
    }
}

/// How well a hand-eye calibration fits.
#[derive(Debug, Clone, PartialEq)]
pub struct HandEyeReport {
    /// All views, in their order, those of a scene camera last.
    pub views: Vec<ViewReport>,
    /// Root mean square distance of all used corners from where they fall when the arm is where it says, pixels.
    pub rms_px: f64,
    /// The same on the target, metres.
    pub rms: f64,
    /// The same when the arm may be a little off at every stand, pixels: what the images alone are off.
    pub image_rms_px: f64,
    /// Turn of the flange about its second axis, radians.
    pub turn: f64,
    /// Why it may not be used; empty when it may.
    pub shortfalls: Vec<Shortfall>,
}

impl HandEyeReport {
    /// The view that fits worst.
    pub fn worst_view(&self) -> Option<&ViewReport> {
        views::worst(&self.views)
    }

    fn new(
        views: Vec<ViewReport>,
        misfit: &fit::Misfit,
        turn: f64,
        main: &Placed,
        thresholds: &HandEyeThresholds,
    ) -> Self {
        let mut report = Self {
            rms_px: views::rms(&views),
            views,
            rms: misfit.on_target,
            image_rms_px: misfit.image_px,
            turn,
            shortfalls: Vec::new(),
        };
        report.check(main, thresholds);
        report
    }

    fn check(&mut self, main: &Placed, thresholds: &HandEyeThresholds) {
        if main.views < thresholds.views {
            self.shortfalls.push(Shortfall::Views {
                found: main.views,
                needed: thresholds.views,
                more: thresholds.views - main.views,
            });
        }
        if self.turn < thresholds.turn {
            self.shortfalls.push(Shortfall::Turns {
                found: self.turn.to_degrees(),
                needed: thresholds.turn.to_degrees(),
            });
        }
        if main.deviations[1] > thresholds.deviation {
            self.shortfalls.push(Shortfall::Pose {
                found: 1e3 * main.deviations[1],
                allowed: 1e3 * thresholds.deviation,
            });
        }
        // A NaN must fail too, hence the form.
        let fits = self.rms <= thresholds.place;
        if !fits {
            self.shortfalls.push(Shortfall::Place {
                found: 1e3 * self.rms,
                allowed: 1e3 * thresholds.place,
                worst: self.worst_view().map_or_else(String::new, |view| view.name.clone()),
            });
        }
    }
}
