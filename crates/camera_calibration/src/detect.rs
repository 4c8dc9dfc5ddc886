//! Finding the target in an image.
//!
//! Squares and markers are found on an 8-bit copy (the crate `calib-targets-charuco`, which reads every marker and gives
//! corners only where it is sure of them); where each corner is, is then measured on the image itself, with all its bits.

use calib_targets_charuco::{CharucoDetectError, CharucoDetector, CharucoParams, GrayImageView};
use imaging::Image;
use nalgebra::Point2;

use crate::corner::refine_corner;
use crate::error::CameraCalibrationError;
use crate::target::CharucoTarget;

/// A homography has eight unknowns, a corner gives two numbers; three times as many show what does not fit.
pub const LEAST_CORNERS: usize = 12;
/// Share of the pixels that may be darker than black, and brighter than white, in the 8-bit copy.
const CLIPPED: f64 = 0.002;
/// A window keeps so far from the marker beside its corner, share of the white margin.
const MARGIN_USED: f64 = 0.9;
/// Half sides of the window in which a corner is measured, pixels.
const WINDOW: [f64; 2] = [2.5, 10.0];

/// A corner of the target as an image shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectedCorner {
    /// Which, see [`CharucoTarget::corner`].
    pub id: usize,
    /// Where; an integer position is the centre of a pixel.
    pub pixel: Point2<f64>,
}

/// Why there is no target in an image.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotFound {
    /// There is no contrast at all.
    #[error("the image is all {brightness} of 65535: is the light on, and the lens open?")]
    Blank {
        /// Of every pixel.
        brightness: u16,
    },
    /// No squares, or none with markers that can be read.
    #[error("{reason}: is the target in view, sharp, evenly lit, and the one that is looked for ({target})?")]
    NoBoard {
        /// What is missing.
        reason: &'static str,
        /// Squares and their side, in words.
        target: String,
    },
    /// Too little of it is in view.
    #[error("only {found} of {all} corners are seen, needed are {needed}: bring more of the target into view")]
    FewCorners {
        /// Corners that are sure.
        found: usize,
        /// Corners of the target.
        all: usize,
        /// Least number.
        needed: usize,
    },
}

/// Finds a target; one serves for any number of images.
#[derive(Debug)]
pub struct TargetDetector {
    target: CharucoTarget,
    detector: CharucoDetector,
}

impl TargetDetector {
    /// For this target.
    pub fn new(target: &CharucoTarget) -> Result<Self, CameraCalibrationError> {
        // Tells a board that cannot be from one that is not there.
        target.checked_board()?;
        let detector = CharucoDetector::new(CharucoParams::for_board(target.board()));
        let detector = detector.map_err(|error| CameraCalibrationError::Board {
            reason: error.to_string(),
        })?;
        Ok(Self {
            target: *target,
            detector,
        })
    }

    /// What is looked for.
    pub fn target(&self) -> &CharucoTarget {
        &self.target
    }

    /// The corners in a linear image, sorted by their numbers; at least [`LEAST_CORNERS`].
    pub fn detect(&self, image: &Image<u16>) -> Result<Vec<DetectedCorner>, NotFound> {
        let bytes = stretched(image)?;
        let view = GrayImageView {
            width: image.width(),
            height: image.height(),
            data: &bytes,
        };
        let found = self.detector.detect(&view).map_err(|error| self.not_found(&error))?;
        let seeds: Vec<DetectedCorner> = found.corners.iter().map(corner).collect();
        let half = self.window(&seeds);
        let mut corners: Vec<DetectedCorner> = seeds
            .iter()
            .filter_map(|seed| {
                let pixel = refine_corner(image, &seed.pixel, half)?;
                Some(DetectedCorner { pixel, ..*seed })
            })
            .collect();
        corners.sort_by_key(|corner| corner.id);
        corners.dedup_by_key(|corner| corner.id);
        if corners.len() < LEAST_CORNERS {
            return Err(NotFound::FewCorners {
                found: corners.len(),
                all: self.target.corner_count(),
                needed: LEAST_CORNERS,
            });
        }
        Ok(corners)
    }

    fn not_found(&self, error: &CharucoDetectError) -> NotFound {
        let reason = match error {
            CharucoDetectError::ChessboardNotDetected => "no board of squares is found",
            CharucoDetectError::NoMarkers => "a board is found, but no marker on it can be read",
            _ => "a board is found, but its markers are not in the target's order",
        };
        let target = &self.target;
        NotFound::NoBoard {
            reason,
            target: format!(
                "{} x {} squares of {:.1} mm",
                target.columns(),
                target.rows(),
                1e3 * target.square()
            ),
        }
    }

    /// Half side of the windows: the white margin around a marker where squares look smallest.
    fn window(&self, corners: &[DetectedCorner]) -> f64 {
        let across = self.target.columns() - 1;
        let is_neighbour = |a: usize, b: usize| a + across == b || (a + 1 == b && !b.is_multiple_of(across));
        let mut least = f64::INFINITY;
        for a in corners {
            for b in corners.iter().filter(|b| is_neighbour(a.id, b.id)) {
                least = least.min((a.pixel - b.pixel).norm());
            }
        }
        let margin = 0.5 * (1.0 - self.target.marker() / self.target.square());
        (MARGIN_USED * margin * least).clamp(WINDOW[0], WINDOW[1])
    }
}

fn corner(found: &calib_targets_charuco::CharucoCorner) -> DetectedCorner {
    DetectedCorner {
        id: found.id as usize,
        pixel: Point2::new(f64::from(found.position.x), f64::from(found.position.y)),
    }
}

/// Eight bits between the darkest and the brightest parts of the image.
fn stretched(image: &Image<u16>) -> Result<Vec<u8>, NotFound> {
    let mut counts = vec![0_usize; 1 << 16];
    for &value in image.pixels() {
        counts[usize::from(value)] += 1;
    }
    let few = (CLIPPED * image.pixels().len() as f64) as usize;
    let value_at = |rank: usize| {
        let mut seen = 0;
        counts.iter().position(|&count| {
            seen += count;
            seen > rank
        })
    };
    let black = value_at(few).unwrap_or(0);
    let white = value_at(image.pixels().len() - 1 - few).unwrap_or(0);
    if white <= black {
        return Err(NotFound::Blank {
            brightness: black as u16,
        });
    }
    let scale = 255.0 / (white - black) as f32;
    let byte = |&value: &u16| ((f32::from(value) - black as f32) * scale).round() as u8;
    Ok(image.pixels().iter().map(byte).collect())
}
