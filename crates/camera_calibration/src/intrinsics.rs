//! One camera: lens and the target's poses.

use geometry::{PinholeCamera, RigidTransform};
use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::bundle::{Bundle, Link, Sighting, State};
use crate::checks::{Shortfall, Thresholds};
use crate::coverage::Coverage;
use crate::error::CameraCalibrationError;
use crate::homography::{Match, homography, pose};
use crate::lens::{FixedLens, LENS, LensValues};
use crate::levenberg::solve;
use crate::target::CharucoTarget;
use crate::views::{self, CameraViews, ViewReport};
use crate::zhang;

/// Views without which there is no lens: two would do for four numbers, the third shows whether they agree.
pub const LEAST_VIEWS: usize = 3;
/// Targets whose directions differ by less are parallel, radians.
const PARALLEL: f64 = 3_f64 * std::f64::consts::PI / 180.0;

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraOptions {
    /// What is not fitted.
    pub fixed: FixedLens,
    /// Where the search starts; what is fixed keeps its value. None: the closed form, no distortion.
    pub start: Option<PinholeCamera>,
    /// What has to be reached.
    pub thresholds: Thresholds,
}

/// A camera as its views tell it.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraCalibration {
    /// Its name.
    pub name: String,
    /// The lens.
    pub camera: PinholeCamera,
    /// Standard deviations of fx, fy, cx, cy (pixels), k1, k2, p1, p2, k3; 0 of what is fixed.
    pub deviations: [f64; LENS],
    /// All views, in their order.
    pub views: Vec<ViewReport>,
    /// Root mean square distance over all used corners, pixels.
    pub rms_px: f64,
    /// Where in the image the corners are.
    pub coverage: Coverage,
    /// Angle between the two targets that are turned furthest from each other, radians.
    pub tilt: f64,
    /// Why it may not be used; empty when it may.
    pub shortfalls: Vec<Shortfall>,
}

impl CameraCalibration {
    /// The view that fits worst.
    pub fn worst_view(&self) -> Option<&ViewReport> {
        views::worst(&self.views)
    }
}

/// Views of a camera as the solver takes them.
pub(crate) struct Prepared {
    pub(crate) matches: Vec<Vec<Match>>,
    /// Position of each in the camera's views.
    pub(crate) used: Vec<usize>,
    pub(crate) reports: Vec<ViewReport>,
}

/// Calibrates one camera.
///
/// # Errors
/// Fewer than [`LEAST_VIEWS`] views that differ, or all of them with parallel targets: no focal length follows from them.
/// A result that is not good enough is no error but has [`CameraCalibration::shortfalls`].
pub fn calibrate_camera(
    target: &CharucoTarget,
    seen: &CameraViews,
    options: &CameraOptions,
) -> Result<CameraCalibration, CameraCalibrationError> {
    let prepared = prepare(target, seen)?;
    let (bundle, start) = single(seen, &prepared, options)?;
    let solved = solve(&bundle, start);
    let covariance = solved.covariance.ok_or_else(|| parallel(seen, &solved.state))?;
    let tilt = tilt(&solved.state.poses);
    if tilt < PARALLEL {
        return Err(parallel(seen, &solved.state));
    }
    let lens = solved.state.lenses[0];
    report(seen, prepared, &lens, &solved.state.poses, &covariance, options)
}

/// Views that show something of their own, at least [`LEAST_VIEWS`].
pub(crate) fn prepare(target: &CharucoTarget, seen: &CameraViews) -> Result<Prepared, CameraCalibrationError> {
    let mut prepared = Prepared {
        matches: Vec::new(),
        used: Vec::new(),
        reports: Vec::new(),
    };
    for (index, view) in seen.views.iter().enumerate() {
        let matches = views::matches(target, &view.corners);
        let before = prepared.used.iter().map(|&used| &seen.views[used]);
        let same = before
            .into_iter()
            .find(|other| views::are_same(&view.corners, &other.corners));
        let reason = if let Some(other) = same {
            format!("the target is where it was in {}", other.name)
        } else if homography(&matches).is_none() {
            format!("its {} corners are on a line", matches.len())
        } else {
            prepared.reports.push(ViewReport {
                left_out: None,
                ..ViewReport::left_out(view, String::new())
            });
            prepared.matches.push(matches);
            prepared.used.push(index);
            continue;
        };
        prepared.reports.push(ViewReport::left_out(view, reason));
    }
    if prepared.used.len() < LEAST_VIEWS {
        let left_out = prepared.reports.iter().filter_map(|report| {
            let reason = report.left_out.as_ref()?;
            Some(format!("{}: {reason}", report.name))
        });
        return Err(CameraCalibrationError::FewViews {
            camera: seen.camera.clone(),
            found: prepared.used.len(),
            needed: LEAST_VIEWS,
            left_out: left_out.collect(),
        });
    }
    Ok(prepared)
}

/// A bundle of one camera, and where to start.
fn single(
    seen: &CameraViews,
    prepared: &Prepared,
    options: &CameraOptions,
) -> Result<(Bundle, State), CameraCalibrationError> {
    let homographies: Vec<_> = prepared
        .matches
        .iter()
        .filter_map(|matches| homography(matches))
        .collect();
    let unknown = || CameraCalibrationError::NoLens {
        camera: seen.camera.clone(),
        views: prepared.used.len(),
    };
    let lens = match options.start {
        Some(camera) => Some(LensValues::of(&camera)),
        None => first_lens(&homographies, seen.size, &options.fixed),
    };
    let lens = lens.ok_or_else(unknown)?;
    let camera = lens.camera(seen.size)?;
    let poses = prepared.matches.iter().map(|matches| first_pose(&camera, matches));
    let poses: Vec<RigidTransform> = poses.collect::<Option<_>>().ok_or_else(unknown)?;
    let sightings = prepared.matches.iter().enumerate().map(|(pose, matches)| Sighting {
        camera: 0,
        chain: vec![Link::Sought(pose)],
        matches: matches.clone(),
    });
    let bundle = Bundle {
        sightings: sightings.collect(),
        fixed: vec![options.fixed],
        priors: Vec::new(),
    };
    Ok((
        bundle,
        State {
            lenses: vec![lens],
            poses,
        },
    ))
}

/// The closed form, no distortion.
fn first_lens(homographies: &[Matrix3<f64>], size: [usize; 2], fixed: &FixedLens) -> Option<LensValues> {
    let ([fx, fy], principal) = zhang::camera_matrix(homographies, size)?;
    let middle = size.map(|side| 0.5 * (side as f64 - 1.0));
    let [cx, cy] = if fixed.has_principal() { middle } else { principal };
    Some(LensValues([fx, fy, cx, cy, 0.0, 0.0, 0.0, 0.0, 0.0]))
}

/// `camera_from_target` without refinement; none when the view does not tell.
pub(crate) fn first_pose(camera: &PinholeCamera, matches: &[Match]) -> Option<RigidTransform> {
    let ideal = |(point, pixel): &Match| Some((*point, camera.unproject(pixel).ok()?.xy().into()));
    let ideal: Vec<Match> = matches.iter().filter_map(ideal).collect();
    pose(&homography(&ideal)?)
}

fn parallel(seen: &CameraViews, state: &State) -> CameraCalibrationError {
    CameraCalibrationError::Parallel {
        camera: seen.camera.clone(),
        views: state.poses.len(),
        degrees: tilt(&state.poses).to_degrees(),
        needed: PARALLEL.to_degrees(),
    }
}

/// The largest angle between two targets' normals.
pub(crate) fn tilt(poses: &[RigidTransform]) -> f64 {
    let normals: Vec<Vector3<f64>> = poses.iter().map(|pose| pose.rotation() * Vector3::z()).collect();
    let pairs = normals
        .iter()
        .enumerate()
        .flat_map(|(i, a)| normals[..i].iter().map(move |b| a.angle(b)));
    pairs.fold(0.0, f64::max)
}

/// What a fit says of a camera whose lens is the covariance's first.
pub(crate) fn report(
    seen: &CameraViews,
    prepared: Prepared,
    lens: &LensValues,
    poses: &[RigidTransform],
    covariance: &DMatrix<f64>,
    options: &CameraOptions,
) -> Result<CameraCalibration, CameraCalibrationError> {
    let camera = lens.camera(seen.size)?;
    let mut reports = prepared.reports;
    for ((&index, pose), matches) in prepared.used.iter().zip(poses).zip(&prepared.matches) {
        reports[index].camera_from_target = Some(*pose);
        reports[index].rms_px = view_rms(lens, pose, matches);
    }
    let mask = options.fixed.mask();
    let deviation = |i: usize| {
        if mask[i] {
            0.0
        } else {
            covariance[(i, i)].max(0.0).sqrt()
        }
    };
    let pixels = prepared.matches.iter().flatten().map(|(_, pixel)| *pixel);
    let mut calibration = CameraCalibration {
        name: seen.camera.clone(),
        camera,
        deviations: std::array::from_fn(deviation),
        rms_px: views::rms(&reports),
        views: reports,
        coverage: Coverage::of(pixels, seen.size),
        tilt: tilt(poses),
        shortfalls: Vec::new(),
    };
    calibration.shortfalls = shortfalls(&calibration, prepared.used.len(), &options.thresholds);
    Ok(calibration)
}

pub(crate) fn view_rms(lens: &LensValues, camera_from_target: &RigidTransform, matches: &[Match]) -> f64 {
    let square = |(point, pixel): &Match| {
        let projected = lens.project(&camera_from_target.transform_point(point).coords);
        projected.map_or(f64::INFINITY, |projected| {
            (projected.pixel - pixel.coords).norm_squared()
        })
    };
    (matches.iter().map(square).sum::<f64>() / matches.len().max(1) as f64).sqrt()
}

fn shortfalls(calibration: &CameraCalibration, used: usize, thresholds: &Thresholds) -> Vec<Shortfall> {
    let mut found = Vec::new();
    if used < thresholds.views {
        found.push(Shortfall::Views {
            found: used,
            needed: thresholds.views,
            more: thresholds.views - used,
        });
    }
    if calibration.tilt < thresholds.tilt {
        found.push(Shortfall::Tilt {
            found: calibration.tilt.to_degrees(),
            needed: thresholds.tilt.to_degrees(),
        });
    }
    let share = calibration.coverage.share();
    if share < thresholds.coverage {
        found.push(Shortfall::Coverage {
            found: 100.0 * share,
            needed: 100.0 * thresholds.coverage,
            towards: calibration.coverage.emptiest().unwrap_or("middle"),
        });
    }
    let focal = calibration.camera.focal();
    let focal_share = (0..2).map(|i| calibration.deviations[i] / focal[i]).fold(0.0, f64::max);
    if focal_share > thresholds.focal_share {
        found.push(Shortfall::Focal {
            found: 100.0 * focal_share,
            allowed: 100.0 * thresholds.focal_share,
        });
    }
    // A NaN must fail too, hence the form.
    let fits = calibration.rms_px <= thresholds.rms_px;
    if !fits {
        found.push(Shortfall::Residual {
            found: calibration.rms_px,
            allowed: thresholds.rms_px,
            worst: calibration
                .worst_view()
                .map_or_else(String::new, |view| view.name.clone()),
        });
    }
    found
}
