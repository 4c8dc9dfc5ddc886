//! What both kinds of hand-eye calibration share.

use geometry::{PinholeCamera, RigidTransform};
use nalgebra::{DMatrix, DVector};

use super::closed_form::{Station, second_turn};
use super::{HandEyeView, metres_per_pixel};
use crate::bundle::{Bundle, Normal, POSE, Sighting, State};
use crate::error::CameraCalibrationError;
use crate::homography::Match;
use crate::intrinsics::{LEAST_VIEWS, first_pose, view_rms};
use crate::lens::LensValues;
use crate::levenberg::Solved;
use crate::target::CharucoTarget;
use crate::views::{self, TargetView, ViewReport};

/// Flanges nearer to each other than this are at the same place: metres and radians.
const SAME_FLANGE: [f64; 2] = [1e-3, 0.5 * std::f64::consts::PI / 180.0];
/// A second turn below this is none, radians.
const LEAST_TURN: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// A view that says something of its own.
pub(super) struct Used {
    /// Among the views.
    pub(super) index: usize,
    pub(super) matches: Vec<Match>,
    /// From the image alone.
    pub(super) camera_from_target: RigidTransform,
}

/// Views that can be used, and a report for each of all.
pub(super) fn prepare(
    target: &CharucoTarget,
    camera: &PinholeCamera,
    views: &[HandEyeView],
) -> Result<(Vec<Used>, Vec<ViewReport>), CameraCalibrationError> {
    let (mut used, mut reports): (Vec<Used>, Vec<ViewReport>) = (Vec::new(), Vec::new());
    for (index, view) in views.iter().enumerate() {
        let seen = TargetView {
            name: view.name.clone(),
            corners: view.corners.clone(),
        };
        let matches = views::matches(target, &view.corners);
        let same = used.iter().map(|used| &views[used.index]).find(|other| is_same(view, other));
        let found = match (same, first_pose(camera, &matches)) {
            (Some(other), _) => Err(format!("the arm stood where it stood in {}", other.name)),
            (None, None) => Err(format!("its {} corners are on a line", matches.len())),
            (None, Some(pose)) => Ok(pose),
        };
        match found {
            Err(reason) => reports.push(ViewReport::left_out(&seen, reason)),
            Ok(camera_from_target) => {
                reports.push(ViewReport {
                    left_out: None,
                    ..ViewReport::left_out(&seen, String::new())
                });
                used.push(Used {
                    index,
                    matches,
                    camera_from_target,
                });
            }
        }
    }
    if used.len() < LEAST_VIEWS {
        let reason = |report: &ViewReport| Some(format!("{}: {}", report.name, report.left_out.as_ref()?));
        return Err(CameraCalibrationError::FewViews {
            camera: "hand-eye".into(),
            found: used.len(),
            needed: LEAST_VIEWS,
            left_out: reports.iter().filter_map(reason).collect(),
        });
    }
    Ok((used, reports))
}

fn is_same(a: &HandEyeView, b: &HandEyeView) -> bool {
    let between = a.base_from_flange.inverse() * b.base_from_flange;
    let [shift, turn] = SAME_FLANGE;
    a.placement == b.placement && between.translation().norm() < shift && between.rotation().angle() < turn
}

/// The second turn, when there is one.
pub(super) fn require_turns(stations: &[Station]) -> Result<f64, CameraCalibrationError> {
    let turn = second_turn(stations);
    // A NaN must fail too, hence the form.
    if turn >= LEAST_TURN {
        return Ok(turn);
    }
    Err(CameraCalibrationError::OneAxis {
        found: turn.to_degrees(),
        needed: LEAST_TURN.to_degrees(),
    })
}

/// Covariance of the unknowns when all corners of an image may be off together, because the arm was not where it said:
/// images, not corners, are what is independent (the "sandwich" estimator with clusters; Cameron and Miller 2015, "A
/// practitioner's guide to cluster-robust inference", equation 11).
pub(super) fn covariance(bundle: &Bundle, solved: &Solved) -> Option<DMatrix<f64>> {
    let inverse = solved.inverse.as_ref()?;
    let size = inverse.nrows();
    let mut spread = DMatrix::zeros(size, size);
    for sighting in &bundle.sightings {
        let mut own = Normal {
            matrix: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
            cost: 0.0,
        };
        bundle.add(&solved.state, sighting, solved.scale, &mut own);
        spread += &own.right * own.right.transpose();
    }
    // An image gives six numbers.
    let given = (POSE * bundle.sightings.len()) as f64;
    let sought = (POSE * solved.state.poses.len()) as f64;
    let correction = if given > sought { given / (given - sought) } else { return None };
    Some(inverse * spread * inverse * correction)
}

/// Fills in where the target was in each sighting's view; gives the root mean square distance on the target, metres.
pub(super) fn fill<'a>(
    state: &State,
    sightings: impl Iterator<Item = (&'a Sighting, &'a mut ViewReport, &'a PinholeCamera)>,
) -> f64 {
    let (mut squares, mut corners) = (0.0, 0);
    for (sighting, report, camera) in sightings {
        let pose = state.camera_from_target(sighting);
        let rms_px = view_rms(&LensValues::of(camera), &pose, &sighting.matches);
        report.rms_px = rms_px;
        report.camera_from_target = Some(pose);
        let count = sighting.matches.len();
        squares += (rms_px * metres_per_pixel(camera, &pose)).powi(2) * count as f64;
        corners += count;
    }
    (squares / corners.max(1) as f64).sqrt()
}
