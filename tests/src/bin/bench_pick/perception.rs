//! From the last frame to ranked grasps, without middleware: two views of 1000 x 1000.

use std::time::Instant;

use calibration_files::LightsFile;
use grasp::{Cup, PlanOptions, ViewInput, plan};
use photometric::{LightRig, SolveOptions, ViewSolution, solve_view};
use scenarios::{RenderedCapture, quantile, repository};
use serde::Serialize;
use sim::scene::View;

const SIZE: usize = 1000;

/// Medians, milliseconds.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Perception {
    /// Both views.
    pub(crate) solve_ms: f64,
    pub(crate) plan_ms: f64,
    /// Solving and planning in turn.
    pub(crate) both_ms: f64,
    pub(crate) grasps: usize,
}

pub(crate) fn measure(runs: usize) -> anyhow::Result<Perception> {
    let rig = LightsFile::read(&repository().join("launch_configs/calibration/lights.yaml"))?.rig()?;
    let captures = [View::rig_c1()?, View::rig_c2()?].map(|view| RenderedCapture::render(view, SIZE));
    let captures = captures.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let (mut solving, mut planning, mut both, mut grasps) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for _ in 0..runs {
        let started = Instant::now();
        let solutions = solve(&captures, &rig)?;
        let solved = started.elapsed();
        let began = Instant::now();
        grasps = plan(&inputs(&captures, &solutions), &Cup::default(), &PlanOptions::default())?
            .grasps
            .len();
        let planned = began.elapsed();
        solving.push(1e3 * solved.as_secs_f64());
        planning.push(1e3 * planned.as_secs_f64());
        both.push(1e3 * (solved + planned).as_secs_f64());
    }
    let median = |values: &[f64]| quantile(values, 0.5).unwrap_or(f64::NAN);
    Ok(Perception {
        solve_ms: median(&solving),
        plan_ms: median(&planning),
        both_ms: median(&both),
        grasps,
    })
}

fn solve(captures: &[RenderedCapture], rig: &LightRig) -> anyhow::Result<Vec<ViewSolution>> {
    let solve = |capture: &RenderedCapture| Ok(solve_view(&capture.capture(rig), &SolveOptions::default())?);
    captures.iter().map(solve).collect()
}

fn inputs<'a>(captures: &'a [RenderedCapture], solutions: &'a [ViewSolution]) -> Vec<ViewInput<'a>> {
    let views = captures.iter().zip(solutions).zip(["c1", "c2"]);
    let input = |((capture, solution), name): ((&'a RenderedCapture, &'a ViewSolution), &'a str)| ViewInput {
        name,
        camera: capture.view().camera,
        base_from_camera: capture.view().base_from_camera,
        normals: &solution.normals.normals,
        confidence: &solution.normals.confidence,
        edges: &solution.edges.edges,
        edge_confidence: &solution.edges.confidence,
        mask: &solution.normals.mask,
        depth: Some(&solution.depth.depth),
    };
    views.map(input).collect()
}
