//! `rakelight eval normals`: how far solved normals are from the truth of path-traced captures.
//!
//! Lights are calibrated from the captures of hemispheres in the same folder, or read from a file; the true lights that
//! the captures describe have no part in it.

mod ablation;
mod score;

use std::time::Instant;

use clap::Args;
use imaging::{Image, contact_sheet, normal_picture};
use photometric::{
    DirectionalLight, LeastSquaresOptions, LightRig, ReferenceOptions, SolveOptions, ViewSolution,
    least_squares_normals, reference_normals, solve_view,
};
use serde::Serialize;

use super::pictures::{GAP, heat};
use super::scenes::{SceneArguments, Subject};
use crate::failure::Failure;
use score::{Score, angles};

/// White in the picture of errors, degrees.
const WHITE_DEGREES: f32 = 30.0;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    scenes: SceneArguments,
    /// Tell instead what each step of the method gains: the same captures with steps left out.
    #[arg(long)]
    ablation: bool,
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
    seconds: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    views: Vec<Row>,
    mean: f64,
    least_squares_mean: f64,
    reference_mean: f64,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    tokio::task::spawn_blocking(move || {
        if arguments.ablation {
            ablation::evaluate(&arguments.scenes)
        } else {
            evaluate(&arguments.scenes)
        }
    })
    .await?
}

fn evaluate(arguments: &SceneArguments) -> Result<(), Failure> {
    let views = arguments.open()?.rows(|subject| {
        let row = score(subject)?;
        if !arguments.json {
            println!("{}", row.for_people());
        }
        Ok(row)
    })?;
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

fn score(subject: &Subject<'_>) -> anyhow::Result<Row> {
    let Subject {
        scene,
        view,
        truth,
        capture,
        lights,
        ..
    } = subject;
    let started = Instant::now();
    let solution = solve_view(capture, &SolveOptions::default())?;
    let seconds = started.elapsed().as_secs_f64();
    let plain = least_squares_normals(&view.stack, &directional(&lights.rig)?, &LeastSquaresOptions::default())?;
    let mask = &solution.normals.mask;
    let reference = reference_normals(capture, mask, &lights.polynomials, &ReferenceOptions::default())?;
    subject.picture("normals", || Ok(picture(subject, &solution)))?;
    let score = |normals: &Image<[f32; 3]>| Score::of(normals, truth, &view.mask);
    Ok(Row {
        scene: (*scene).to_owned(),
        camera: view.camera.clone(),
        normals: score(&solution.normals.normals),
        least_squares: score(&plain.normals),
        reference: score(&reference.normals),
        seconds,
    })
}

/// What was found, the truth, and the angle between them: black 0, white [`WHITE_DEGREES`] and more, blue where one is
/// missing.
fn picture(subject: &Subject<'_>, solution: &ViewSolution) -> Image<[u8; 3]> {
    let found = &solution.normals.normals;
    let errors = angles(found, subject.truth, &subject.view.mask);
    let pictures = [
        normal_picture(found),
        normal_picture(&subject.truth.normals),
        heat(&errors, WHITE_DEGREES),
    ];
    contact_sheet(&pictures, pictures.len(), GAP).unwrap_or_else(|| normal_picture(found))
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
        format!(
            "{:16} {}  {}   published method {:5.2}, plain least squares {:5.2}   {:.0} ms",
            self.scene,
            self.camera,
            self.normals,
            self.reference.mean,
            self.least_squares.mean,
            1e3 * self.seconds
        )
    }
}
