//! The arm carries the camera, the target stands; perhaps another camera looks on.

use geometry::{PinholeCamera, RigidTransform};

use super::arm_slack::Slack;
use super::closed_form::{Station, park_martin};
use super::fit::{self, Used};
use super::{HandEyeReport, HandEyeThresholds, HandEyeView};
use crate::bundle::{Bundle, Link, Sighting, State, inverse_deviations, pose_deviations};
use crate::detect::DetectedCorner;
use crate::error::CameraCalibrationError;
use crate::homography::Match;
use crate::intrinsics::first_pose;
use crate::lens::{FixedLens, LensValues};
use crate::mean::mean_pose;
use crate::stereo::Placed;
use crate::target::CharucoTarget;
use crate::views::{self, TargetView, ViewReport};

/// The standing target in an image of a camera that stands as well.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneView {
    /// What people call the image.
    pub name: String,
    /// As found.
    pub corners: Vec<DetectedCorner>,
    /// At which of its places the target stood.
    pub placement: usize,
}

/// A camera that stands and sees the target where the one on the arm sees it.
#[derive(Debug, Clone, Copy)]
pub struct SceneCamera<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its lens.
    pub camera: &'a PinholeCamera,
    /// What it saw; of several views of one placement the first is used.
    pub views: &'a [SceneView],
}

/// A camera on the flange.
#[derive(Debug, Clone, PartialEq)]
pub struct EyeInHand {
    /// Where it is.
    pub flange_from_camera: Placed,
    /// `base_from_target` of every placement that was seen, by its number.
    pub placements: Vec<(usize, Placed)>,
    /// `base_from_camera` of the scene camera, if one looked on.
    pub scene: Option<Placed>,
    /// How well it fits.
    pub report: HandEyeReport,
}

/// Finds a camera on the flange from views of a standing target, and with it where another camera stands.
///
/// # Errors
/// Fewer than three different stands of the arm, turns about one axis only, or a scene camera that saw no placement.
pub fn calibrate_eye_in_hand(
    target: &CharucoTarget,
    camera: &PinholeCamera,
    views: &[HandEyeView],
    scene: Option<SceneCamera<'_>>,
    thresholds: &HandEyeThresholds,
) -> Result<EyeInHand, CameraCalibrationError> {
    let (used, mut reports) = fit::prepare(target, camera, views)?;
    let placements = Placements::of(&used, views);
    let stations: Vec<Station> = used.iter().map(|used| station(used, views)).collect();
    let turn = fit::require_turns(&stations)?;
    let undetermined = || CameraCalibrationError::Undetermined {
        what: "the camera's place on the flange",
    };
    let flange_from_camera = park_martin(&stations).ok_or_else(undetermined)?;
    let starts = placements.starts(&used, views, &flange_from_camera).ok_or_else(undetermined)?;
    let onlookers = match scene {
        Some(scene) => onlookers(target, &scene, &placements, &mut reports)?,
        None => Vec::new(),
    };
    let mut poses = vec![flange_from_camera.inverse()];
    poses.extend(&starts);
    let mut lenses = vec![LensValues::of(camera)];
    let scene_pose = poses.len();
    if let Some(scene) = scene {
        let from_base = onlookers.iter().map(|seen| seen.camera_from_target * starts[seen.place].inverse());
        poses.push(mean_pose(&from_base.collect::<Vec<_>>()).ok_or_else(undetermined)?);
        lenses.push(LensValues::of(scene.camera));
    }
    let slack = Slack::new(&mut poses, used.len());
    let arm = used.iter().enumerate();
    let mut sightings: Vec<Sighting> = arm
        .map(|(stand, used)| sighting(used, views, &placements, slack.link(stand)))
        .collect();
    sightings.extend(onlookers.iter().map(|seen| Sighting {
        camera: 1,
        chain: vec![Link::Sought(scene_pose), Link::Sought(1 + seen.place)],
        matches: seen.matches.clone(),
    }));
    let mut bundle = Bundle {
        fixed: vec![FixedLens::ALL; lenses.len()],
        sightings,
        priors: Vec::new(),
    };
    let solved = slack.solve(&mut bundle, State { lenses, poses });
    let covariance = solved.covariance.as_ref().ok_or_else(undetermined)?;
    let state = &solved.state;
    let inverse = |pose: usize, views: usize| Placed {
        pose: state.poses[pose].inverse(),
        deviations: inverse_deviations(covariance, state.pose_column(pose), &state.poses[pose].translation()),
        views,
    };
    let place = |(place, &number): (usize, &usize)| {
        let seen = used.iter().filter(|used| views[used.index].placement == number).count();
        let placed = Placed {
            pose: state.poses[1 + place],
            deviations: pose_deviations(covariance, state.pose_column(1 + place)),
            views: seen,
        };
        (number, placed)
    };
    let misfit = fit::fill(&bundle, &solved, &slack, &mut reports);
    let main = inverse(0, used.len());
    Ok(EyeInHand {
        report: HandEyeReport::new(reports, &misfit, turn, &main, thresholds),
        flange_from_camera: main,
        placements: placements.numbers.iter().enumerate().map(place).collect(),
        scene: scene.map(|_| inverse(scene_pose, onlookers.len())),
    })
}

/// `base_from_flange X camera_from_target` is the same for all of a placement, with `X = flange_from_camera`.
fn station(used: &Used, views: &[HandEyeView]) -> Station {
    Station {
        arm: views[used.index].base_from_flange,
        eye: used.camera_from_target.inverse(),
        group: views[used.index].placement,
    }
}

fn sighting(used: &Used, views: &[HandEyeView], placements: &Placements, slack: Link) -> Sighting {
    let view = &views[used.index];
    let place = placements.position(view.placement).unwrap_or(0);
    Sighting {
        camera: 0,
        chain: vec![
            Link::Sought(0),
            slack,
            Link::Known(view.base_from_flange.inverse()),
            Link::Sought(1 + place),
        ],
        matches: used.matches.clone(),
    }
}

/// Numbers of the placements that were seen.
struct Placements {
    numbers: Vec<usize>,
}

impl Placements {
    fn of(used: &[Used], views: &[HandEyeView]) -> Self {
        let mut numbers: Vec<usize> = used.iter().map(|used| views[used.index].placement).collect();
        numbers.sort_unstable();
        numbers.dedup();
        Self { numbers }
    }

    fn position(&self, number: usize) -> Option<usize> {
        self.numbers.iter().position(|&known| known == number)
    }

    /// `base_from_target` of each, as all of its views see it on average.
    fn starts(&self, used: &[Used], views: &[HandEyeView], flange_from_camera: &RigidTransform) -> Option<Vec<RigidTransform>> {
        let start = |&number: &usize| {
            let own = used.iter().filter(|used| views[used.index].placement == number);
            let poses = own.map(|used| {
                views[used.index].base_from_flange * *flange_from_camera * used.camera_from_target
            });
            mean_pose(&poses.collect::<Vec<_>>())
        };
        self.numbers.iter().map(start).collect()
    }
}

/// What a scene camera saw of a placement.
struct Onlooker {
    /// Position among the placements.
    place: usize,
    matches: Vec<Match>,
    camera_from_target: RigidTransform,
}

fn onlookers(
    target: &CharucoTarget,
    scene: &SceneCamera<'_>,
    placements: &Placements,
    reports: &mut Vec<ViewReport>,
) -> Result<Vec<Onlooker>, CameraCalibrationError> {
    let mut found: Vec<Onlooker> = Vec::new();
    for view in scene.views {
        let matches = views::matches(target, &view.corners);
        let place = placements.position(view.placement);
        let pose = first_pose(scene.camera, &matches);
        let reason = match (place, pose) {
            (Some(place), _) if found.iter().any(|known| known.place == place) => "its placement is in an earlier view",
            (None, _) => "the camera on the arm did not see the target there",
            (_, None) => "its corners are on a line",
            (Some(place), Some(camera_from_target)) => {
                found.push(Onlooker {
                    place,
                    matches,
                    camera_from_target,
                });
                ""
            }
        };
        let seen = TargetView {
            name: view.name.clone(),
            corners: view.corners.clone(),
        };
        let mut report = ViewReport::left_out(&seen, reason.to_owned());
        report.left_out = report.left_out.filter(|reason| !reason.is_empty());
        reports.push(report);
    }
    if found.is_empty() {
        return Err(CameraCalibrationError::NoPlacement {
            camera: scene.name.to_owned(),
        });
    }
    Ok(found)
}
