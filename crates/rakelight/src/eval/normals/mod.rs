//! `rakelight eval normals`: how far solved normals are from the truth of path-traced captures.
//!
//! Lights are calibrated from the captures of hemispheres in the same folder, or read from a file; the true lights that
//! the captures describe have no part in it.

mod score;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, anyhow};
use calibration_files::LightsFile;
use clap::Args;
use photometric::{
    CalibrationOptions, Capture, DirectionalLight, LeastSquaresOptions, LightRig, PixelRays, PolynomialRig,
    ReferenceOptions, SensorNoise, SolveOptions, TargetView, calibrate_lights, least_squares_normals,
    reference_normals, solve_view,
};
use rig_scenes::{CapturedView, SceneFolder, Truth, find_scenes};
use serde::Serialize;

use crate::failure::Failure;
use score::{DepthScore, Score};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder of captures with truth: scenes two folders below, or one scene itself.
    #[arg(long, value_name = "DIR")]
    truth: PathBuf,
    /// Calibration of the lights; without it they are calibrated from the hemispheres below the folder.
    #[arg(long, value_name = "FILE")]
    lights: Option<PathBuf>,
    /// Only scenes of this name, such as `octagon2`.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Tell the figures as one JSON object.
    #[arg(long)]
    json: bool,
}

/// One view's figures.
#[derive(Debug, Serialize)]
struct Row {
    scene: String,
    camera: String,
    normals: Score,
    /// Plain least squares with one direction per light, on the same pixels.
    least_squares: Score,
    /// The published system's method.
    reference: Score,
    /// None where no part was seen to stand on the table.
    depth: Option<DepthScore>,
    seconds: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    views: Vec<Row>,
    mean: f64,
    least_squares_mean: f64,
    reference_mean: f64,
}

/// The lights, and the published system's models of them.
struct Lights {
    rig: LightRig,
    polynomials: PolynomialRig,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    tokio::task::spawn_blocking(move || evaluate(&arguments)).await?
}

fn evaluate(arguments: &Arguments) -> Result<(), Failure> {
    let paths = find_scenes(&arguments.truth).map_err(Failure::usage)?;
    let scenes = paths.iter().map(|path| SceneFolder::open(path));
    let scenes = scenes.collect::<Result<Vec<_>, _>>().map_err(Failure::usage)?;
    let lights = match &arguments.lights {
        Some(path) => {
            let rig = read_rig(path)?;
            let polynomials = PolynomialRig::from_panels(&rig);
            Lights { rig, polynomials }
        }
        None => calibrated(&scenes)?,
    };
    let wanted = |scene: &&SceneFolder| arguments.only.as_ref().is_none_or(|name| scene.name() == *name);
    let mut views = Vec::new();
    for scene in scenes
        .iter()
        .filter(|scene| scene.hemisphere().is_none())
        .filter(wanted)
    {
        for view in scene.views()? {
            let Some(truth) = &view.truth else { continue };
            let row = score(scene.name(), &view, truth, &lights)?;
            if !arguments.json {
                println!("{}", row.for_people());
            }
            views.push(row);
        }
    }
    if views.is_empty() {
        return Err(anyhow!("no scene with truth was found below {}", arguments.truth.display()).into());
    }
    let mean = |of: fn(&Row) -> f64| views.iter().map(of).sum::<f64>() / views.len() as f64;
    let report = Report {
        mean: mean(|row| row.normals.mean),
        least_squares_mean: mean(|row| row.least_squares.mean),
        reference_mean: mean(|row| row.reference.mean),
        views,
    };
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!(
            "mean of {} views: {:.2} degrees; published method {:.2}, plain least squares {:.2}",
            report.views.len(),
            report.mean,
            report.reference_mean,
            report.least_squares_mean
        );
    }
    Ok(())
}

fn read_rig(path: &Path) -> Result<LightRig, Failure> {
    let rig = LightsFile::read(path).and_then(|file| file.rig());
    rig.with_context(|| format!("{}", path.display()))
        .map_err(Failure::usage)
}

/// The lights from every hemisphere among the scenes.
fn calibrated(scenes: &[SceneFolder]) -> Result<Lights, Failure> {
    let targets: Vec<&SceneFolder> = scenes.iter().filter(|scene| scene.hemisphere().is_some()).collect();
    if targets.is_empty() {
        let problem = anyhow!("no captures of hemispheres among the scenes: give the lights by --lights FILE");
        return Err(Failure::usage(problem));
    }
    let mut captures = Vec::new();
    for scene in targets {
        for view in scene.views()? {
            captures.push((scene.name(), PixelRays::new(&view.view.camera), view));
        }
    }
    let view = |capture| {
        let (placement, rays, captured): &(String, PixelRays, CapturedView) = capture;
        TargetView {
            placement,
            camera: &captured.camera,
            stack: &captured.stack,
            view: &captured.view,
            rays,
        }
    };
    let calibration = calibrate_lights(&captures.iter().map(view).collect::<Vec<_>>(), &CalibrationOptions::RIG)?;
    match calibration.failure {
        None => Ok(Lights {
            rig: calibration.rig,
            polynomials: calibration.polynomials,
        }),
        Some(reason) => Err(anyhow!("the calibration failed: {reason}").into()),
    }
}

fn score(scene: String, view: &CapturedView, truth: &Truth, lights: &Lights) -> anyhow::Result<Row> {
    let rig = &lights.rig;
    let rays = PixelRays::new(&view.view.camera);
    let capture = Capture {
        stack: &view.stack,
        view: &view.view,
        rays: &rays,
        rig,
        noise: SensorNoise::RIG,
    };
    let started = Instant::now();
    let solution = solve_view(&capture, &SolveOptions::default())?;
    let seconds = started.elapsed().as_secs_f64();
    let plain = least_squares_normals(&view.stack, &directional(rig)?, &LeastSquaresOptions::default())?;
    let mask = &solution.normals.mask;
    let reference = reference_normals(&capture, mask, &lights.polynomials, &ReferenceOptions::default())?;
    Ok(Row {
        scene,
        reference: Score::of(&reference.normals, truth, &view.mask),
        camera: view.camera.clone(),
        normals: Score::of(&solution.normals.normals, truth, &view.mask),
        least_squares: Score::of(&plain.normals, truth, &view.mask),
        depth: DepthScore::of(&solution.depth, truth, &view.mask),
        seconds,
    })
}

/// The panels as distant lights, as seen from the middle of the mat.
fn directional(rig: &LightRig) -> anyhow::Result<Vec<DirectionalLight>> {
    let middle = geometry::nalgebra::Point3::new(0.43, 0.0, 0.015);
    let light = |panel: &photometric::PanelModel| {
        let vector = panel.light_vector(&middle);
        DirectionalLight::new(panel.channel, vector.into(), vector.norm())
    };
    Ok(rig.panels().iter().map(light).collect::<Result<_, _>>()?)
}

impl Row {
    fn for_people(&self) -> String {
        let depth = self
            .depth
            .map_or_else(|| "no depth".to_owned(), |depth| depth.to_string());
        format!(
            "{:16} {}  {}   published method {:5.2}, plain least squares {:5.2}   depth {depth}   {:.0} ms",
            self.scene,
            self.camera,
            self.normals,
            self.reference.mean,
            self.least_squares.mean,
            1e3 * self.seconds
        )
    }
}
