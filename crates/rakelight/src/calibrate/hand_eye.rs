//! `rakelight calibrate hand-eye`: pictures of the target and the arm's poses in, the cameras' poses out.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use camera_aravis::CalibrationFile;
use camera_calibration::{
    HandEyeReport, HandEyeThresholds, HandEyeView, Placed, SceneCamera, SceneView, calibrate_eye_in_hand,
    calibrate_eye_to_hand,
};
use clap::{ArgGroup, Args};
use devices::Binning;
use geometry::PinholeCamera;

use super::report;
use super::shots::{Shot, Shots, Sources};
use crate::failure::Failure;

const BASE: &str = "link_base";

#[derive(Args)]
#[command(group(ArgGroup::new("kind").required(true).args(["eye_in_hand", "eye_to_hand"])))]
pub(crate) struct Arguments {
    /// The arm carries this camera; the target stands still, in each bag or folder at one place.
    #[arg(long, value_name = "CAMERA")]
    eye_in_hand: Option<String>,
    /// This camera stands still; the arm carries the target.
    #[arg(long, value_name = "CAMERA")]
    eye_to_hand: Option<String>,
    /// Another camera that stands still and sees the standing target, too.
    #[arg(long, value_name = "CAMERA", conflicts_with = "eye_to_hand")]
    scene_camera: Option<String>,
    #[command(flatten)]
    sources: Sources,
    /// Calibration file of a camera's lens, of the whole sensor; without, its `camera_info` in the bag.
    #[arg(long = "lens", value_name = "CAMERA=FILE", value_parser = lens_file)]
    lenses: Vec<(String, PathBuf)>,
    /// Where the poses go.
    #[arg(short, long, value_name = "FILE", default_value = "cameras.yaml")]
    output: PathBuf,
    /// Replace poses that are there.
    #[arg(long)]
    force: bool,
}

fn lens_file(text: &str) -> Result<(String, PathBuf), String> {
    let (camera, file) = text
        .split_once('=')
        .ok_or("expected CAMERA=FILE, such as c1=calibration/c1.yaml")?;
    Ok((camera.to_owned(), file.into()))
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.output.exists() && !arguments.force {
        let problem = anyhow!("{} is there already; --force replaces it", arguments.output.display());
        return Err(Failure::usage(problem));
    }
    let shots = arguments.sources.read()?;
    let (found, report) = match (&arguments.eye_in_hand, &arguments.eye_to_hand) {
        (Some(camera), _) => eye_in_hand(arguments, &shots, camera)?,
        (None, Some(camera)) => eye_to_hand(arguments, &shots, camera)?,
        (None, None) => {
            return Err(Failure::usage(anyhow!(
                "--eye-in-hand or --eye-to-hand names the camera"
            )));
        }
    };
    print!("{}", report::hand_eye(&report));
    for pose in &found {
        let name = format!("{}_from_{}", pose.parent, pose.frame);
        print!("{}", report::placed(&name, &pose.placed));
    }
    if let Some(reason) = report.shortfalls.first() {
        return Err(Failure::from(anyhow!(
            "the calibration failed: {reason}; nothing was written"
        )));
    }
    let pose = |found: &Found| {
        let rms = report.rms_px;
        super::camera_pose(&found.camera, &found.parent, &found.frame, &found.placed, rms)
    };
    let poses = found.iter().map(pose);
    super::write_poses(&arguments.output, poses.collect())
}

/// A camera's pose in what it is fixed to.
struct Found {
    camera: String,
    parent: String,
    frame: String,
    placed: Placed,
}

fn eye_in_hand(arguments: &Arguments, shots: &Shots, camera: &str) -> Result<(Vec<Found>, HandEyeReport), Failure> {
    let own = shots.of(camera)?;
    let (lens, views) = (lens(arguments, &own)?, views(&own)?);
    let thresholds = HandEyeThresholds::default();
    let Some(scene) = &arguments.scene_camera else {
        let result = calibrate_eye_in_hand(&shots.target, &lens, &views, None, &thresholds)?;
        return Ok((
            vec![on_flange(arguments, &own, result.flange_from_camera)],
            result.report,
        ));
    };
    let others = shots.of(scene)?;
    let seen = |shot: &&Shot| SceneView {
        name: format!("{}, {scene}", shot.name),
        corners: shot.corners.clone(),
        placement: shot.placement,
    };
    let onlooker = SceneCamera {
        name: scene,
        camera: &self::lens(arguments, &others)?,
        views: &others.iter().map(seen).collect::<Vec<_>>(),
    };
    let result = calibrate_eye_in_hand(&shots.target, &lens, &views, Some(onlooker), &thresholds)?;
    let mut found = vec![on_flange(arguments, &own, result.flange_from_camera)];
    found.extend(result.scene.map(|placed| over_table(&others, placed)));
    Ok((found, result.report))
}

fn eye_to_hand(arguments: &Arguments, shots: &Shots, camera: &str) -> Result<(Vec<Found>, HandEyeReport), Failure> {
    let own = shots.of(camera)?;
    let lens = lens(arguments, &own)?;
    let result = calibrate_eye_to_hand(&shots.target, &lens, &views(&own)?, &HandEyeThresholds::default())?;
    Ok((vec![over_table(&own, result.base_from_camera)], result.report))
}

fn on_flange(arguments: &Arguments, own: &[&Shot], placed: Placed) -> Found {
    Found {
        camera: own[0].camera.clone(),
        parent: arguments.sources.flange.clone(),
        frame: own[0].frame.clone(),
        placed,
    }
}

fn over_table(own: &[&Shot], placed: Placed) -> Found {
    Found {
        camera: own[0].camera.clone(),
        parent: BASE.to_owned(),
        frame: own[0].frame.clone(),
        placed,
    }
}

/// Pictures with where the arm was; one without is an error, for what is missing is seldom missing once.
fn views(own: &[&Shot]) -> Result<Vec<HandEyeView>, Failure> {
    let view = |shot: &&Shot| match &shot.base_from_flange {
        Ok(base_from_flange) => Ok(HandEyeView {
            name: shot.name.clone(),
            base_from_flange: *base_from_flange,
            corners: shot.corners.clone(),
            placement: shot.placement,
        }),
        Err(reason) => Err(Failure::from(anyhow!("{}: where was the arm? {reason:#}", shot.name))),
    };
    own.iter().map(view).collect()
}

/// The lens that all of the pictures were taken with.
fn lens(arguments: &Arguments, own: &[&Shot]) -> Result<PinholeCamera, Failure> {
    let (first, size) = (own[0], own[0].size);
    if let Some(other) = own.iter().find(|shot| shot.size != size) {
        return Err(Failure::from(anyhow!(
            "{} and {} differ in size",
            first.name,
            other.name
        )));
    }
    let named = arguments.lenses.iter().find(|(camera, _)| *camera == first.camera);
    if let Some((_, file)) = named {
        return lens_of(file, size).map_err(|error| Failure::usage(error.context(file.display().to_string())));
    }
    match &first.lens {
        Ok(lens) => Ok(*lens),
        Err(reason) => Err(Failure::usage(anyhow!(
            "the lens of {camera} is not known ({reason:#}): name its file, --lens {camera}=FILE",
            camera = first.camera
        ))),
    }
}

/// Of pictures that are smaller than the sensor by a whole number, which was their binning.
fn lens_of(file: &Path, [width, height]: [usize; 2]) -> anyhow::Result<PinholeCamera> {
    let whole = CalibrationFile::read(file.to_str().context("the file's name is no text")?)?;
    let (sensor_width, sensor_height) = (whole.width() as usize, whole.height() as usize);
    let factor = sensor_width / width;
    if factor == 0 || (factor * width, factor * height) != (sensor_width, sensor_height) {
        return Err(anyhow!(
            "it is for {sensor_width} x {sensor_height} pixels, the pictures have {width} x {height}"
        ));
    }
    let binning = Binning {
        horizontal: factor as u32,
        vertical: factor as u32,
    };
    Ok(*whole.scaled(binning, None)?.camera())
}
