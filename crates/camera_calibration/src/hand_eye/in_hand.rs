//! The arm carries the camera, the target stands; perhaps another camera looks on.

use geometry::{PinholeCamera, RigidTransform};
use nalgebra::DMatrix;

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
    let starts = placements
        .starts(&used, views, &flange_from_camera)
        .ok_or_else(undetermined)?;
    let onlookers = match scene {
        Some(scene) => onlookers(target, &scene, &placements, &mut reports)?,
        None => Vec::new(),
    };
    let seen = Seen {
        used,
        views,
        placements,
        onlookers,
        scene,
    };
    let (mut bundle, start, layout) = seen
        .model(camera, &flange_from_camera, starts)
        .ok_or_else(undetermined)?;
    let solved = layout.slack.solve(&mut bundle, start);
    let covariance = solved.covariance.as_ref().ok_or_else(undetermined)?;
    let misfit = fit::fill(&bundle, &solved, &layout.slack, &mut reports);
    let flange_from_camera = inverse(&solved.state, covariance, CAMERA, seen.used.len());
    Ok(EyeInHand {
        report: HandEyeReport::new(reports, &misfit, turn, &flange_from_camera, thresholds),
        flange_from_camera,
        placements: seen.placed(&solved.state, covariance),
        scene: layout
            .scene
            .map(|pose| inverse(&solved.state, covariance, pose, seen.onlookers.len())),
    })
}

/// Among the poses: `camera_from_flange`, then `base_from_target` of every placement.
const CAMERA: usize = 0;
const FIRST_PLACEMENT: usize = 1;

/// Everything that was seen.
struct Seen<'a> {
    used: Vec<Used>,
    views: &'a [HandEyeView],
    placements: Placements,
    onlookers: Vec<Onlooker>,
    scene: Option<SceneCamera<'a>>,
}

/// Where the other poses are.
struct Layout {
    /// `scene_from_base`.
    scene: Option<usize>,
    slack: Slack,
}

impl Seen<'_> {
    /// What is fitted, and where to start.
    fn model(
        &self,
        camera: &PinholeCamera,
        flange_from_camera: &RigidTransform,
        starts: Vec<RigidTransform>,
    ) -> Option<(Bundle, State, Layout)> {
        let from_base: Vec<RigidTransform> = self
            .onlookers
            .iter()
            .map(|seen| seen.camera_from_target * starts[seen.place].inverse())
            .collect();
        let mut lenses = vec![LensValues::of(camera)];
        let mut poses = vec![flange_from_camera.inverse()];
        poses.extend(starts);
        let mut scene_pose = None;
        if let Some(scene) = self.scene {
            scene_pose = Some(poses.len());
            poses.push(mean_pose(&from_base)?);
            lenses.push(LensValues::of(scene.camera));
        }
        let slack = Slack::new(&mut poses, self.used.len());
        let own = self.used.iter().enumerate().map(|(stand, used)| Sighting {
            camera: 0,
            chain: self.arm_chain(used, slack.link(stand)),
            matches: used.matches.clone(),
        });
        let others = scene_pose.iter().flat_map(|&scene| {
            self.onlookers.iter().map(move |seen| Sighting {
                camera: 1,
                chain: vec![Link::Sought(scene), Link::Sought(FIRST_PLACEMENT + seen.place)],
                matches: seen.matches.clone(),
            })
        });
        let bundle = Bundle {
            fixed: vec![FixedLens::ALL; lenses.len()],
            sightings: own.chain(others).collect(),
            priors: Vec::new(),
        };
        let layout = Layout {
            scene: scene_pose,
            slack,
        };
        Some((bundle, State { lenses, poses }, layout))
    }

    fn arm_chain(&self, used: &Used, slack: Link) -> Vec<Link> {
        let view = &self.views[used.index];
        let place = self.placements.position(view.placement).unwrap_or(0);
        vec![
            Link::Sought(CAMERA),
            slack,
            Link::Known(view.base_from_flange.inverse()),
            Link::Sought(FIRST_PLACEMENT + place),
        ]
    }

    /// `base_from_target` of every placement.
    fn placed(&self, state: &State, covariance: &DMatrix<f64>) -> Vec<(usize, Placed)> {
        let place = |(place, &number): (usize, &usize)| {
            let own = self
                .used
                .iter()
                .filter(|used| self.views[used.index].placement == number);
            let placed = Placed {
                pose: state.poses[FIRST_PLACEMENT + place],
                deviations: pose_deviations(covariance, state.pose_column(FIRST_PLACEMENT + place)),
                views: own.count(),
            };
            (number, placed)
        };
        self.placements.numbers.iter().enumerate().map(place).collect()
    }
}

/// The inverse of a pose that was found.
fn inverse(state: &State, covariance: &DMatrix<f64>, pose: usize, views: usize) -> Placed {
    let found = &state.poses[pose];
    Placed {
        pose: found.inverse(),
        deviations: inverse_deviations(covariance, state.pose_column(pose), &found.translation()),
        views,
    }
}

/// `base_from_flange X camera_from_target` is the same for all of a placement, with `X = flange_from_camera`.
fn station(used: &Used, views: &[HandEyeView]) -> Station {
    Station {
        arm: views[used.index].base_from_flange,
        eye: used.camera_from_target.inverse(),
        group: views[used.index].placement,
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
    fn starts(
        &self,
        used: &[Used],
        views: &[HandEyeView],
        flange_from_camera: &RigidTransform,
    ) -> Option<Vec<RigidTransform>> {
        let start = |&number: &usize| {
            let own = used.iter().filter(|used| views[used.index].placement == number);
            let poses =
                own.map(|used| views[used.index].base_from_flange * *flange_from_camera * used.camera_from_target);
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
