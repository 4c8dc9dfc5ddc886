//! `rakelight solve`: a recorded bag in, a bag of results out.

mod output;
mod pictures;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, anyhow};
use calibration_files::LightsFile;
use clap::{Args, ValueEnum};
use photometric::{
    Capture, LightRig, NormalSolution, PhotometricError, PolynomialRig, ReferenceOptions, SensorNoise, SolveOptions,
    ViewSolution, solve_view, solve_view_by_reference,
};
use recording::Bag;

use crate::captured::{self, Captured};
use crate::failure::Failure;
use output::Output;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Bag with captures.
    bag: PathBuf,
    /// Calibration of the lights; without it they are taken to be where the rig was drawn.
    #[arg(long, value_name = "FILE")]
    lights: Option<PathBuf>,
    /// How normals are found.
    #[arg(long, value_enum, default_value_t = Method::NearField)]
    method: Method,
    /// Folder of the new bag with the results; must not exist.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write pictures of the images and the normals into this folder.
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Panels near the work, shadow hypotheses, depth fed back, the object's own light.
    NearField,
    /// The published system's: quadratic light models and shadow weights; a yardstick.
    Reference,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    tokio::task::spawn_blocking(move || solve_bag(&arguments)).await?
}

fn solve_bag(arguments: &Arguments) -> Result<(), Failure> {
    if !arguments.bag.exists() {
        return Err(Failure::usage(anyhow!("no bag at {}", arguments.bag.display())));
    }
    let lights = arguments.lights.as_deref().map(read_lights).transpose()?;
    if lights.is_none() {
        eprintln!("no --lights: the panels are taken to be where the rig was drawn, in a black room");
    }
    let rig = match &lights {
        Some(file) => file.rig().map_err(Failure::usage)?,
        None => LightRig::nominal(),
    };
    if let Some(folder) = &arguments.png {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let bag = Bag::open(&arguments.bag)?;
    let mut output = Output::create(&arguments.output).map_err(Failure::usage)?;
    let mut solved = 0_usize;
    let problems = captured::for_each(&bag, |captured| {
        if let Some(file) = &lights {
            let (width, height) = (captured.stack.width(), captured.stack.height());
            file.require_camera(captured.camera_name(), width, height)?;
        }
        let started = Instant::now();
        let solution = solve(&captured, &rig, arguments.method)?;
        println!(
            "{}",
            summary(&captured, &solution.normals, started.elapsed().as_secs_f64())
        );
        if let Some(folder) = &arguments.png {
            pictures::write(folder, &captured, &solution)?;
        }
        output.add(&captured, &solution)?;
        solved += 1;
        Ok(())
    })?;
    output.finish()?;
    println!("{solved} solved: {}", arguments.output.display());
    finish(solved, &problems)
}

fn read_lights(path: &Path) -> Result<LightsFile, Failure> {
    let file = LightsFile::read(path).with_context(|| format!("{}", path.display()));
    file.map_err(Failure::usage)
}

fn finish(solved: usize, problems: &[String]) -> Result<(), Failure> {
    for problem in problems {
        eprintln!("not solved: {problem}");
    }
    match (solved, problems.len()) {
        (0, 0) => Err(anyhow!("the bag holds no capture").into()),
        (_, 0) => Ok(()),
        (_, count) => Err(anyhow!("{count} parts of the bag could not be used").into()),
    }
}

fn solve(captured: &Captured, rig: &LightRig, method: Method) -> Result<ViewSolution, PhotometricError> {
    let capture = Capture {
        stack: &captured.stack,
        view: &captured.view,
        rays: &captured.rays,
        rig,
        noise: SensorNoise::RIG,
    };
    match method {
        Method::NearField => solve_view(&capture, &SolveOptions::default()),
        Method::Reference => solve_view_by_reference(
            &capture,
            &PolynomialRig::from_panels(rig),
            &ReferenceOptions::default(),
            &SolveOptions::default(),
        ),
    }
}

/// A line about a solved view.
fn summary(captured: &Captured, solution: &NormalSolution, seconds: f64) -> String {
    let quality = solution.quality();
    let mut text = format!(
        "{} {}: {} normals on {} object pixels, {} of them by fewer than three lights, mean confidence {:.2}, {:.0} ms",
        captured.id,
        captured.camera_name(),
        quality.normals,
        solution.mask.count(),
        quality.few_lights,
        quality.confidence,
        1e3 * seconds
    );
    if let Some(doubt) = quality.doubt() {
        text += "\n  DOUBTFUL: ";
        text += &doubt;
    }
    text
}
