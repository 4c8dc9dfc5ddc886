//! `rakelight calibrate cameras`: pictures of the target in, a calibration file for each camera out.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use camera_aravis::CalibrationFile;
use camera_calibration::{
    CameraCalibration, CameraOptions, CameraViews, FixedLens, LensPart, Placed, TargetView, calibrate_cameras,
};
use clap::{Args, ValueEnum};

use super::report;
use super::shots::{Shots, Sources};
use crate::failure::Failure;

/// Where the cameras are to each other.
const POSES: &str = "cameras.yaml";

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    sources: Sources,
    /// Cameras to calibrate, the first one first; all that are in the pictures when none is named.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    cameras: Vec<String>,
    /// Nothing but the target moved between the captures: find the cameras' places to each other, too.
    #[arg(long)]
    together: bool,
    /// Numbers of the lens that stay where they start: no distortion, the principal point in the middle.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "k3")]
    fix: Vec<Fix>,
    /// Sensor pixels that became one of the pictures', in each direction: the files are those of the whole sensor.
    #[arg(long, value_name = "N", default_value_t = 1)]
    binning: usize,
    /// Folder that the files go to: `<camera>.yaml`, and with --together `cameras.yaml`.
    #[arg(short, long, value_name = "DIR", default_value = "calibration")]
    output: PathBuf,
    /// Replace files that are there.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Fix {
    Nothing,
    Principal,
    K1,
    K2,
    Tangential,
    K3,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let fixed = fixed(&arguments.fix)?;
    let shots = arguments.sources.read()?;
    let names = if arguments.cameras.is_empty() {
        shots.cameras()
    } else {
        arguments.cameras.clone()
    };
    if names.is_empty() {
        return Err(Failure::from(anyhow!(
            "the target was found in no picture; nothing was written"
        )));
    }
    let files = files(arguments, &names)?;
    let seen = names
        .iter()
        .map(|name| views(&shots, name))
        .collect::<Result<Vec<_>, _>>()?;
    let options = CameraOptions {
        fixed,
        ..CameraOptions::default()
    };
    let (cameras, others) = calibrate(arguments, &shots, &seen, options)?;
    for camera in &cameras {
        print!("{}", report::camera(camera));
    }
    for (name, other) in names[1..].iter().zip(&others) {
        print!("{}", report::placed(&format!("{}_from_{name}", names[0]), other));
    }
    if let Some(bad) = cameras.iter().find(|camera| !camera.shortfalls.is_empty()) {
        let reason = &bad.shortfalls[0];
        return Err(Failure::from(anyhow!(
            "the calibration of {} failed: {reason}; nothing was written",
            bad.name
        )));
    }
    write(arguments, &files, &cameras)?;
    if arguments.together {
        write_places(&arguments.output.join(POSES), &shots, &cameras, &others)?;
    }
    Ok(())
}

fn fixed(names: &[Fix]) -> Result<FixedLens, Failure> {
    if names.contains(&Fix::Nothing) && names.len() > 1 {
        return Err(Failure::usage(anyhow!("--fix nothing leaves no room for others")));
    }
    let parts = names.iter().filter_map(|name| match name {
        Fix::Nothing => None,
        Fix::Principal => Some(LensPart::Principal),
        Fix::K1 => Some(LensPart::K1),
        Fix::K2 => Some(LensPart::K2),
        Fix::Tangential => Some(LensPart::Tangential),
        Fix::K3 => Some(LensPart::K3),
    });
    Ok(FixedLens::of(&parts.collect::<Vec<_>>()))
}

/// Files to write, none of which is there.
fn files(arguments: &Arguments, names: &[String]) -> Result<Vec<PathBuf>, Failure> {
    let files: Vec<PathBuf> = names
        .iter()
        .map(|name| arguments.output.join(format!("{name}.yaml")))
        .collect();
    let places = arguments.together.then(|| arguments.output.join(POSES));
    let taken = files.iter().chain(&places).find(|file| file.exists());
    match taken {
        Some(file) if !arguments.force => Err(Failure::usage(anyhow!(
            "{} is there already; --force replaces it",
            file.display()
        ))),
        _ => Ok(files),
    }
}

/// What a camera saw; all of its pictures have to be of one size.
fn views(shots: &Shots, name: &str) -> Result<CameraViews, Failure> {
    let own = shots.of(name)?;
    let size = own[0].size;
    if let Some(other) = own.iter().find(|shot| shot.size != size) {
        let ([width, height], [other_width, other_height]) = (size, other.size);
        return Err(Failure::from(anyhow!(
            "{name}: {} has {other_width} x {other_height} pixels, the others {width} x {height}",
            other.name
        )));
    }
    let view = |shot: &&super::shots::Shot| TargetView {
        name: shot.name.clone(),
        corners: shot.corners.clone(),
    };
    Ok(CameraViews {
        camera: name.to_owned(),
        size,
        views: own.iter().map(view).collect(),
    })
}

fn calibrate(
    arguments: &Arguments,
    shots: &Shots,
    seen: &[CameraViews],
    options: CameraOptions,
) -> Result<(Vec<CameraCalibration>, Vec<Placed>), Failure> {
    if arguments.together {
        let rig = calibrate_cameras(&shots.target, seen, &vec![options; seen.len()])?;
        return Ok((rig.cameras, rig.others));
    }
    let alone = seen
        .iter()
        .map(|seen| camera_calibration::calibrate_camera(&shots.target, seen, &options));
    Ok((alone.collect::<Result<_, _>>()?, Vec::new()))
}

fn write(arguments: &Arguments, files: &[PathBuf], cameras: &[CameraCalibration]) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.output).with_context(|| arguments.output.display().to_string())?;
    for (file, calibration) in files.iter().zip(cameras) {
        let whole = calibration.camera.enlarged(arguments.binning).map_err(Failure::usage)?;
        let path = file.to_str().context("the file's name is no text")?;
        CalibrationFile::new(&calibration.name, &whole).write(path)?;
        println!("written: {path}");
    }
    Ok(())
}

fn write_places(file: &Path, shots: &Shots, cameras: &[CameraCalibration], others: &[Placed]) -> Result<(), Failure> {
    let first = shots.of(&cameras[0].name)?[0].frame.clone();
    let mut poses = Vec::new();
    for (camera, other) in cameras[1..].iter().zip(others) {
        let frame = &shots.of(&camera.name)?[0].frame;
        let (name, rms) = (&camera.name, camera.rms_px);
        poses.push(super::camera_pose(name, &first, frame, other, rms));
    }
    super::write_poses(file, poses)
}
