//! `rakelight calibrate`: what a cell has to know of its own parts.

mod cameras;
mod hand_eye;
mod lights;
mod report;
mod shots;
mod target;

use std::path::Path;

use calibration_files::{CameraPose, CameraPosesFile};
use camera_calibration::Placed;
use clap::{Args, Subcommand};

use crate::failure::Failure;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Fit the panels to captures of a matte white hemisphere at a dozen places on the mat.
    Lights(lights::Arguments),
    /// Find the cameras' lenses from captures of a printed target.
    Cameras(cameras::Arguments),
    /// Find where cameras are on the arm or over the table from captures of a printed target.
    HandEye(hand_eye::Arguments),
    /// Draw the target to print.
    Target(target::Arguments),
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    tokio::task::spawn_blocking(move || match &arguments.what {
        What::Lights(arguments) => lights::run(arguments),
        What::Cameras(arguments) => cameras::run(arguments),
        What::HandEye(arguments) => hand_eye::run(arguments),
        What::Target(arguments) => target::run(arguments),
    })
    .await?
}

/// What a file says of a camera that was found.
fn camera_pose(camera: &str, parent: &str, frame: &str, placed: &Placed, rms_px: f64) -> CameraPose {
    let mut pose = CameraPose::new(camera, parent, frame, &placed.pose);
    let [turn, shift] = placed.deviations;
    (pose.deviation_rad, pose.deviation_m) = (Some(turn), Some(shift));
    (pose.rms_px, pose.views) = (Some(rms_px), Some(placed.views));
    pose
}

fn write_poses(file: &Path, poses: Vec<CameraPose>) -> Result<(), Failure> {
    let date = chrono::Utc::now().format("%Y-%m-%dT%H:%M:%SZ").to_string();
    CameraPosesFile::new(date, poses).write(file)?;
    println!("written: {}", file.display());
    Ok(())
}
