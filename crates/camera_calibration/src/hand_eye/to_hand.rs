//! The camera stands, the arm carries the target.

use geometry::PinholeCamera;

use super::arm_slack::Slack;
use super::closed_form::{Station, park_martin};
use super::fit::{self, Used};
use super::{HandEyeReport, HandEyeThresholds, HandEyeView};
use crate::bundle::{Bundle, Link, Sighting, State, inverse_deviations, pose_deviations};
use crate::error::CameraCalibrationError;
use crate::lens::{FixedLens, LensValues};
use crate::mean::mean_pose;
use crate::stereo::Placed;
use crate::target::CharucoTarget;

/// A camera over the table.
#[derive(Debug, Clone, PartialEq)]
pub struct EyeToHand {
    /// Where it is.
    pub base_from_camera: Placed,
    /// Where the target is on the arm.
    pub flange_from_target: Placed,
    /// How well it fits.
    pub report: HandEyeReport,
}

/// Finds a standing camera from views of a target that the arm carries.
///
/// # Errors
/// Fewer than three different stands of the arm, or turns about one axis only.
pub fn calibrate_eye_to_hand(
    target: &CharucoTarget,
    camera: &PinholeCamera,
    views: &[HandEyeView],
    thresholds: &HandEyeThresholds,
) -> Result<EyeToHand, CameraCalibrationError> {
    let (used, mut reports) = fit::prepare(target, camera, views)?;
    let stations: Vec<Station> = used.iter().map(|used| station(used, views)).collect();
    let turn = fit::require_turns(&stations)?;
    let undetermined = || CameraCalibrationError::Undetermined {
        what: "the camera's place",
    };
    let base_from_camera = park_martin(&stations).ok_or_else(undetermined)?;
    let on_flange = used.iter().map(|used| {
        let flange_from_base = views[used.index].base_from_flange.inverse();
        flange_from_base * base_from_camera * used.camera_from_target
    });
    let flange_from_target = mean_pose(&on_flange.collect::<Vec<_>>()).ok_or_else(undetermined)?;
    let mut poses = vec![base_from_camera.inverse(), flange_from_target];
    let slack = Slack::new(&mut poses, used.len());
    let sighting = |(stand, used): (usize, &Used)| Sighting {
        camera: 0,
        chain: vec![
            Link::Sought(0),
            Link::Known(views[used.index].base_from_flange),
            slack.link(stand),
            Link::Sought(1),
        ],
        matches: used.matches.clone(),
    };
    let mut bundle = Bundle {
        sightings: used.iter().enumerate().map(sighting).collect(),
        fixed: vec![FixedLens::ALL],
        priors: Vec::new(),
    };
    let lenses = vec![LensValues::of(camera)];
    let solved = slack.solve(&mut bundle, State { lenses, poses });
    let covariance = solved.covariance.as_ref().ok_or_else(undetermined)?;
    let state = &solved.state;
    let count = used.len();
    let base_from_camera = Placed {
        pose: state.poses[0].inverse(),
        deviations: inverse_deviations(covariance, state.pose_column(0), &state.poses[0].translation()),
        views: count,
    };
    let misfit = fit::fill(&bundle, &solved, &slack, &mut reports);
    Ok(EyeToHand {
        report: HandEyeReport::new(reports, &misfit, turn, &base_from_camera, thresholds),
        base_from_camera,
        flange_from_target: Placed {
            pose: state.poses[1],
            deviations: pose_deviations(covariance, state.pose_column(1)),
            views: count,
        },
    })
}

/// `flange_from_base X camera_from_target` is the same for all, with `X = base_from_camera`.
fn station(used: &Used, views: &[HandEyeView]) -> Station {
    Station {
        arm: views[used.index].base_from_flange.inverse(),
        eye: used.camera_from_target.inverse(),
        group: 0,
    }
}
