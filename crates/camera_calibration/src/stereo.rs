//! Several cameras that see the target at the same time.

use geometry::RigidTransform;

use crate::bundle::{Bundle, Link, Sighting, State, inverse_deviations};
use crate::error::CameraCalibrationError;
use crate::intrinsics::{self, CameraCalibration, CameraOptions, Prepared, calibrate_camera};
use crate::lens::{LENS, LensValues};
use crate::levenberg::solve;
use crate::mean::mean_pose;
use crate::target::CharucoTarget;
use crate::views::CameraViews;

/// Views that the first camera and another need in common.
pub const LEAST_COMMON: usize = 3;

/// Where a camera is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// The pose.
    pub pose: RigidTransform,
    /// Standard deviations of rotation (radians) and translation (metres).
    pub deviations: [f64; 2],
    /// Views it follows from.
    pub views: usize,
}

/// Cameras and where they are to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct RigCalibration {
    /// In the order in which they were given.
    pub cameras: Vec<CameraCalibration>,
    /// `first_from_camera` of all but the first.
    pub others: Vec<Placed>,
}

/// Calibrates cameras alone, then all of them at once with their places to each other.
///
/// Views with the same name were taken at the same time. The cameras have to be fixed to each other.
///
/// # Errors
/// As of [`calibrate_camera`], and when a camera has fewer than [`LEAST_COMMON`] views in common with the first.
pub fn calibrate_cameras(
    target: &CharucoTarget,
    seen: &[CameraViews],
    options: &[CameraOptions],
) -> Result<RigCalibration, CameraCalibrationError> {
    let alone = seen
        .iter()
        .zip(options)
        .map(|(seen, options)| calibrate_camera(target, seen, options));
    let alone = alone.collect::<Result<Vec<_>, _>>()?;
    if alone.len() < 2 {
        return Ok(RigCalibration {
            cameras: alone,
            others: Vec::new(),
        });
    }
    let prepared = seen.iter().map(|seen| intrinsics::prepare(target, seen));
    let prepared = prepared.collect::<Result<Vec<_>, _>>()?;
    let firsts = first_from_cameras(seen, &alone)?;
    let rig = Rig::new(seen, &prepared, &alone, &firsts);
    let bundle = Bundle {
        sightings: rig.sightings,
        fixed: options.iter().map(|options| options.fixed).collect(),
        priors: Vec::new(),
    };
    let solved = solve(&bundle, rig.start);
    let covariance = solved.covariance.ok_or(CameraCalibrationError::Undetermined {
        what: "the cameras' places to each other",
    })?;
    let state = &solved.state;
    let mut cameras = Vec::new();
    for (index, (prepared, (seen, options))) in prepared.into_iter().zip(seen.iter().zip(options)).enumerate() {
        let own = bundle.sightings.iter().filter(|sighting| sighting.camera == index);
        let poses: Vec<RigidTransform> = own.map(|sighting| state.camera_from_target(sighting)).collect();
        let lens = &state.lenses[index];
        let part = covariance.view((LENS * index, LENS * index), (LENS, LENS)).into_owned();
        cameras.push(intrinsics::report(seen, prepared, lens, &poses, &part, options)?);
    }
    let other = |(index, first): (usize, &Start)| Placed {
        pose: state.poses[index].inverse(),
        deviations: inverse_deviations(&covariance, state.pose_column(index), &state.poses[index].translation()),
        views: first.views,
    };
    Ok(RigCalibration {
        cameras,
        others: firsts.iter().enumerate().map(other).collect(),
    })
}

/// `first_from_camera` as a start.
struct Start {
    pose: RigidTransform,
    views: usize,
}

fn first_from_cameras(seen: &[CameraViews], alone: &[CameraCalibration]) -> Result<Vec<Start>, CameraCalibrationError> {
    let first = &alone[0];
    let pose_in_first = |name: &str| {
        let view = first.views.iter().find(|view| view.name == name)?;
        view.camera_from_target
    };
    let start = |other: &CameraCalibration| {
        let both = other.views.iter().filter_map(|view| {
            let (there, here) = (view.camera_from_target?, pose_in_first(&view.name)?);
            Some(here * there.inverse())
        });
        let both: Vec<RigidTransform> = both.collect();
        match mean_pose(&both) {
            Some(pose) if both.len() >= LEAST_COMMON => Ok(Start {
                pose,
                views: both.len(),
            }),
            _ => Err(CameraCalibrationError::FewCommon {
                first: seen[0].camera.clone(),
                other: other.name.clone(),
                found: both.len(),
                needed: LEAST_COMMON,
            }),
        }
    };
    alone[1..].iter().map(start).collect()
}

/// Poses: `camera_from_first` of the other cameras, then `first_from_target` of every name.
struct Rig {
    sightings: Vec<Sighting>,
    start: State,
}

impl Rig {
    fn new(seen: &[CameraViews], prepared: &[Prepared], alone: &[CameraCalibration], firsts: &[Start]) -> Self {
        let mut rig = Self {
            sightings: Vec::new(),
            start: State {
                lenses: alone.iter().map(|alone| LensValues::of(&alone.camera)).collect(),
                poses: firsts.iter().map(|first| first.pose.inverse()).collect(),
            },
        };
        let mut names: Vec<&str> = Vec::new();
        for (camera, (seen, prepared)) in seen.iter().zip(prepared).enumerate() {
            for (&index, matches) in prepared.used.iter().zip(&prepared.matches) {
                let Some(camera_from_target) = alone[camera].views[index].camera_from_target else {
                    continue;
                };
                let name = seen.views[index].name.as_str();
                let known = names.iter().position(|&known| known == name);
                let place = known.unwrap_or_else(|| {
                    names.push(name);
                    let first_from_camera = camera.checked_sub(1).map(|other| firsts[other].pose);
                    let first = first_from_camera.unwrap_or_else(RigidTransform::identity);
                    rig.start.poses.push(first * camera_from_target);
                    names.len() - 1
                });
                let own = Link::Sought(firsts.len() + place);
                let chain = match camera.checked_sub(1) {
                    None => vec![own],
                    Some(other) => vec![Link::Sought(other), own],
                };
                rig.sightings.push(Sighting {
                    camera,
                    chain,
                    matches: matches.clone(),
                });
            }
        }
        rig
    }
}
