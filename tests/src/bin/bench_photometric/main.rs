//! Measures how long a capture takes to solve: normals, depth edges, depth, all of it, on all cores and on one.
//!
//! The capture is rendered here, 1000 x 1000 pixels and seven lights; nothing is read but the lights' calibration. The
//! published method and a plain numpy solver (`tests/peers/photometric_peer.py`) run on the same images in the same run
//! as yardsticks.

mod peer;
mod timing;

use std::path::Path;

use calibration_files::LightsFile;
use clap::Parser;
use photometric::{
    Capture, EdgeInput, EdgeOptions, IntegrationInput, IntegrationOptions, LightRig, PolynomialRig, ReferenceOptions,
    SolveOptions, integrate, object_mask, occlusion_edges, reference_normals, solve_normals, solve_view,
};
use scenarios::RenderedCapture;
use serde::Serialize;
use sim::scene::View;

use timing::{peak_mb, reset_peak, threads};

#[derive(Parser)]
#[command(about = "Measures how long a capture takes to solve; see the README for the figures to expect")]
struct Arguments {
    /// Print one JSON object as the last thing on standard output.
    #[arg(long)]
    json: bool,
    /// Pixels along each side.
    #[arg(long, default_value_t = 1000)]
    size: usize,
    /// Runs of each step; the median counts.
    #[arg(long, default_value_t = 9)]
    runs: usize,
}

/// Medians, milliseconds.
#[derive(Debug, Clone, Copy, Serialize)]
struct Times {
    #[serde(rename = "mask_ms")]
    mask: f64,
    #[serde(rename = "normals_ms")]
    normals: f64,
    #[serde(rename = "edges_ms")]
    edges: f64,
    #[serde(rename = "depth_ms")]
    depth: f64,
    #[serde(rename = "total_ms")]
    total: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    two_threads: Times,
    one_thread: Times,
    /// The largest resident memory of the process while solving, images included.
    peak_mb: f64,
    reference_normals_ms: f64,
    numpy_normals_ms: Option<f64>,
    size: usize,
    lights: usize,
    object_pixels: usize,
    threads: usize,
}

fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let rig = LightsFile::read(&root.join("launch_configs/calibration/lights.yaml"))?.rig()?;
    let subject = RenderedCapture::render(View::rig_c1()?, arguments.size)?;
    let report = measure(&subject, &rig, &arguments)?;
    println!("{}", for_people(&report));
    if arguments.json {
        println!("{}", serde_json::to_string(&report)?);
    }
    Ok(())
}

fn measure(subject: &RenderedCapture, rig: &LightRig, arguments: &Arguments) -> anyhow::Result<Report> {
    let capture = subject.capture(rig);
    reset_peak();
    let two_threads = times(&capture, arguments.runs)?;
    let peak_mb = peak_mb();
    let one_thread = threads(1, || times(&capture, arguments.runs))??;
    let mask = object_mask(&capture, &SolveOptions::default().mask)?;
    let polynomials = PolynomialRig::from_panels(rig);
    let reference_normals_ms = timing::median_ms(arguments.runs.min(3), || {
        reference_normals(&capture, &mask, &polynomials, &ReferenceOptions::default())
    })?;
    Ok(Report {
        two_threads,
        one_thread,
        peak_mb,
        reference_normals_ms,
        numpy_normals_ms: peer::numpy_ms(&capture, &mask)?,
        size: arguments.size,
        lights: rig.panels().len(),
        object_pixels: mask.count(),
        threads: rayon::current_num_threads(),
    })
}

/// Each step by itself, and all of them as a node runs them.
fn times(capture: &Capture<'_>, runs: usize) -> anyhow::Result<Times> {
    let options = SolveOptions::default();
    let mask = object_mask(capture, &options.mask)?;
    let normals = solve_normals(capture, &mask, &options)?;
    let edges = EdgeInput {
        capture,
        mask: Some(&mask),
        depth: None,
    };
    let depth = IntegrationInput {
        normals: &normals.normals,
        confidence: &normals.confidence,
        mask: &mask,
        view: capture.view,
        rays: capture.rays,
    };
    Ok(Times {
        mask: timing::median_ms(runs, || object_mask(capture, &options.mask))?,
        normals: timing::median_ms(runs, || solve_normals(capture, &mask, &options))?,
        edges: timing::median_ms(runs, || occlusion_edges(&edges, &EdgeOptions::default()))?,
        depth: timing::median_ms(runs, || integrate(&depth, &IntegrationOptions::default()))?,
        total: timing::median_ms(runs, || solve_view(capture, &options))?,
    })
}

fn for_people(report: &Report) -> String {
    let line = |times: &Times, threads: usize| {
        format!(
            "{threads} thread(s): mask {:.0} ms, normals {:.0} ms, edges {:.1} ms, depth {:.0} ms, all {:.0} ms",
            times.mask, times.normals, times.edges, times.depth, times.total
        )
    };
    let numpy = report
        .numpy_normals_ms
        .map_or_else(|| "not there".to_owned(), |ms| format!("{ms:.0} ms"));
    format!(
        "{size} x {size}, {} lights, {} object pixels, {:.0} MB at most\n{}\n{}\npublished method: {:.0} ms; numpy: {numpy}",
        report.lights,
        report.object_pixels,
        report.peak_mb,
        line(&report.two_threads, report.threads),
        line(&report.one_thread, 1),
        report.reference_normals_ms,
        size = report.size,
    )
}
