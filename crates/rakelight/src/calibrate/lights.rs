//! `rakelight calibrate lights`: bags of the target's captures in, `lights.yaml` out.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use calibration_files::{LightResidual, LightsFile, MadeWith, PlacementResidual};
use clap::Args;
use photometric::{
    CalibrationOptions, LightCalibration, LightReport, ObjectMaskOptions, PlacementReport, TargetView, calibrate_lights,
};
use recording::Bag;

use crate::captured::{self, Captured};
use crate::failure::Failure;

/// Parts of the mat along x and y in which placements are counted, some 0.12 m wide.
const CELLS: [usize; 2] = [4, 5];

#[derive(Args)]
pub(crate) struct Arguments {
    /// Bag with captures of the target, one for each place; may be given several times.
    #[arg(long = "bag", value_name = "BAG", required = true)]
    bags: Vec<PathBuf>,
    /// Where the calibration goes.
    #[arg(short, long, value_name = "FILE", default_value = "lights.yaml")]
    output: PathBuf,
    /// Radius of the hemisphere, metres.
    #[arg(long, value_name = "METRES", default_value_t = 0.04)]
    radius: f64,
    /// Replace a calibration that is there.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.output.exists() && !arguments.force {
        let problem = anyhow!("{} is there already; --force replaces it", arguments.output.display());
        return Err(Failure::usage(problem));
    }
    if !(arguments.radius > 0.001 && arguments.radius < 0.5) {
        let problem = anyhow!("--radius {} is outside 0.001 to 0.5 m", arguments.radius);
        return Err(Failure::usage(problem));
    }
    let captures = read(&arguments.bags)?;
    let options = CalibrationOptions {
        radius: arguments.radius,
        ..CalibrationOptions::RIG
    };
    let calibration = calibrate_lights(&views(&captures), &options)?;
    print!("{}", report(&calibration));
    if let Some(reason) = &calibration.failure {
        return Err(Failure::from(anyhow!(
            "the calibration failed: {reason}; nothing was written"
        )));
    }
    let date = chrono::Utc::now().format("%Y-%m-%dT%H:%M:%SZ").to_string();
    let residuals = calibration.lights.iter().map(residual).collect();
    let placements = calibration.placements.iter().map(placement).collect();
    let file = LightsFile::new(&calibration.rig, date, made_with(&captures), residuals);
    file.with_placements(placements).write(&arguments.output)?;
    println!("written: {}", arguments.output.display());
    Ok(())
}

fn read(bags: &[PathBuf]) -> Result<Vec<Captured>, Failure> {
    let mut captures = Vec::new();
    for path in bags {
        if !path.exists() {
            return Err(Failure::usage(anyhow!("no bag at {}", path.display())));
        }
        let bag = Bag::open(path)?;
        let problems = captured::for_each(&bag, |captured| {
            captures.push(captured);
            Ok(())
        })
        .with_context(|| format!("{}", path.display()))?;
        for problem in problems {
            eprintln!("{}: {problem}", path.display());
        }
    }
    Ok(captures)
}

pub(crate) fn views(captures: &[Captured]) -> Vec<TargetView<'_>> {
    let view = |captured| {
        let Captured {
            id, stack, view, rays, ..
        }: &Captured = captured;
        TargetView {
            placement: id,
            camera: captured.camera_name(),
            stack,
            view,
            rays,
        }
    };
    captures.iter().map(view).collect()
}

fn made_with(captures: &[Captured]) -> Vec<MadeWith> {
    let mut cameras: Vec<MadeWith> = Vec::new();
    for captured in captures {
        let camera = captured.camera_name();
        if cameras.iter().all(|made| made.camera != camera) {
            cameras.push(MadeWith {
                camera: camera.to_owned(),
                width: captured.stack.width(),
                height: captured.stack.height(),
            });
        }
    }
    cameras
}

fn residual(light: &LightReport) -> LightResidual {
    LightResidual {
        channel: light.channel,
        samples: light.samples,
        median_sigmas: light.median_sigmas,
        rms_percent: 100.0 * light.rms_share,
    }
}

fn placement(report: &PlacementReport) -> PlacementResidual {
    PlacementResidual {
        placement: report.placement.clone(),
        centre: report.centre,
        median_sigmas: report.median_sigmas,
        left_out: report.dropped.clone(),
    }
}

/// How many used placements stand in each part of the mat: a line along y for each step along x, away from the arm.
fn coverage(calibration: &LightCalibration) -> Vec<String> {
    let counts = calibration.coverage(&ObjectMaskOptions::default(), CELLS);
    let empty = counts.iter().flatten().filter(|&&count| count == 0).count();
    let mut lines = vec!["  placements over the mat (down: away from the arm, right: to its left):".to_owned()];
    lines.extend(counts.iter().map(|row| {
        let cells: Vec<String> = row.iter().map(usize::to_string).collect();
        format!("    {}", cells.join(" "))
    }));
    let all = CELLS[0] * CELLS[1];
    if empty > 0 {
        lines.push(format!(
            "  {empty} of {all} parts have none: the light there is told by the panels' model alone"
        ));
    }
    lines
}

/// Placements, then lights, a line each.
fn report(calibration: &LightCalibration) -> String {
    let mut lines = Vec::new();
    for placement in &calibration.placements {
        let at = placement
            .centre
            .map_or_else(|| "not found".to_owned(), |[x, y]| format!("at ({x:+.4}, {y:+.4}) m"));
        let fit = placement
            .median_sigmas
            .map_or_else(String::new, |sigmas| format!(", median misfit {sigmas:.2} sigma"));
        let dropped = placement
            .dropped
            .as_ref()
            .map_or_else(String::new, |why| format!("; LEFT OUT: {why}"));
        lines.push(format!("  {}: {at}{fit}{dropped}", placement.placement));
    }
    for light in &calibration.lights {
        lines.push(format!(
            "  L{}: {} samples, median misfit {:.2} sigma, RMS {:.1} % of the signal",
            light.channel,
            light.samples,
            light.median_sigmas,
            100.0 * light.rms_share
        ));
    }
    lines.extend(coverage(calibration));
    lines.push(String::new());
    lines.join("\n")
}
