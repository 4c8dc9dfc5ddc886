//! What both kinds of hand-eye calibration share.

use geometry::{PinholeCamera, RigidTransform};

use super::HandEyeView;
use super::arm_slack::Slack;
use super::closed_form::{Station, second_turn};
use crate::bundle::Bundle;
use crate::error::CameraCalibrationError;
use crate::homography::Match;
use crate::intrinsics::{LEAST_VIEWS, first_pose, view_rms};
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
        let same = used
            .iter()
            .map(|used| &views[used.index])
            .find(|other| is_same(view, other));
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

/// Root mean square distances.
pub(super) struct Misfit {
    /// On the target when the arm is where it says, metres.
    pub(super) on_target: f64,
    /// In the image when it may be a little off, pixels.
    pub(super) image_px: f64,
}

/// Fills in where the target was in each used view.
pub(super) fn fill(bundle: &Bundle, solved: &Solved, slack: &Slack, reports: &mut [ViewReport]) -> Misfit {
    let plain = slack.taken_out(&solved.state);
    let used = reports.iter_mut().filter(|report| report.left_out.is_none());
    let (mut on_target, mut in_image, mut corners) = (0.0, 0.0, 0.0);
    for (sighting, report) in bundle.sightings.iter().zip(used) {
        let lens = &plain.lenses[sighting.camera];
        let pose = plain.camera_from_target(sighting);
        report.rms_px = view_rms(lens, &pose, &sighting.matches);
        report.camera_from_target = Some(pose);
        let count = sighting.matches.len() as f64;
        let metres_per_pixel = pose.translation().z / lens.0[0];
        on_target += count * (report.rms_px * metres_per_pixel).powi(2);
        let image = view_rms(lens, &solved.state.camera_from_target(sighting), &sighting.matches);
        in_image += count * image.powi(2);
        corners += count;
    }
    Misfit {
        on_target: (on_target / corners).sqrt(),
        image_px: (in_image / corners).sqrt(),
    }
}
