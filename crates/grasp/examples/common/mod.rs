//! Captures with truth, solved: what examples and tests plan on.
#![allow(dead_code, reason = "each program uses its part")]

use std::error::Error;
use std::path::Path;

use calibration_files::LightsFile;
use grasp::ViewInput;
use photometric::{Capture, LightRig, PixelRays, SensorNoise, SolveOptions, ViewSolution, solve_view};
use rig_scenes::{CapturedView, SceneFolder};

/// A view of a scene and what shading says of it.
pub(crate) struct Solved {
    pub(crate) captured: CapturedView,
    pub(crate) solution: ViewSolution,
}

/// The lights as calibrated from the rig's hemispheres.
pub(crate) fn lights() -> Result<LightRig, Box<dyn Error>> {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../launch_configs/calibration/lights.yaml"
    );
    Ok(LightsFile::read(Path::new(path))?.rig()?)
}

/// Solves every view of a scene.
pub(crate) fn solve_scene(folder: &Path, rig: &LightRig) -> Result<Vec<Solved>, Box<dyn Error>> {
    let solve = |captured: CapturedView| {
        let rays = PixelRays::new(&captured.view.camera);
        let capture = Capture {
            stack: &captured.stack,
            view: &captured.view,
            rays: &rays,
            rig,
            noise: SensorNoise::RIG,
        };
        let solution = solve_view(&capture, &SolveOptions::default())?;
        Ok(Solved { captured, solution })
    };
    SceneFolder::open(folder)?.views()?.into_iter().map(solve).collect()
}

/// What planning takes.
pub(crate) fn inputs(solved: &[Solved]) -> Vec<ViewInput<'_>> {
    fn input(Solved { captured, solution }: &Solved) -> ViewInput<'_> {
        ViewInput {
            name: &captured.camera,
            camera: captured.view.camera,
            base_from_camera: captured.view.base_from_camera,
            normals: &solution.normals.normals,
            confidence: &solution.normals.confidence,
            edges: &solution.edges.edges,
            edge_confidence: &solution.edges.confidence,
            mask: &solution.normals.mask,
            depth: Some(&solution.depth.depth),
        }
    }
    solved.iter().map(input).collect()
}
