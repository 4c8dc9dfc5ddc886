//! Grasps on solved path-traced captures, against the true surface.

#[path = "../examples/common/mod.rs"]
mod scenes;

use std::path::{Path, PathBuf};

use geometry::nalgebra::{Point2, Point3, Vector3};
use grasp::{Cup, Grasp, PlanOptions, Source, plan};
use rig_scenes::{CapturedView, find_scenes};
use scenes::{inputs, lights, solve_scene};

fn scenes() -> Option<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/rig/objects");
    if folder.exists() {
        return Some(find_scenes(&folder).unwrap());
    }
    println!("SKIPPED: {} is missing", folder.display());
    None
}

/// Distance along the true normal, metres, and angle to it, degrees, where a view shows the contact.
fn errors(grasp: &Grasp, captured: &CapturedView) -> (f64, f64) {
    let (view, truth) = (&captured.view, captured.truth.as_ref().unwrap());
    let in_camera = view.base_from_camera.inverse().transform_point(&grasp.contact);
    let pixel = view.camera.project(&in_camera).unwrap();
    let (x, y) = (pixel.x.round() as usize, pixel.y.round() as usize);
    let ray = view.camera.unproject(&Point2::new(x as f64, y as f64)).unwrap();
    let depth = f64::from(*truth.depth.get(x, y).unwrap());
    let point = view.base_from_camera.transform_point(&Point3::from(ray * depth));
    let normal = Vector3::from(truth.normals.get(x, y).unwrap().map(f64::from));
    (
        (grasp.contact - point).dot(&normal),
        normal.angle(&grasp.normal).to_degrees(),
    )
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

#[test]
fn triangulated_grasps_are_within_1_mm_and_5_degrees() {
    let Some(scenes) = scenes() else { return };
    let rig = lights().unwrap();
    let (mut lengths, mut angles, mut names) = (Vec::new(), Vec::new(), Vec::new());
    for folder in scenes {
        let solved = solve_scene(&folder, &rig).unwrap();
        let inputs = inputs(&solved);
        // Spot is too round for the usual cup.
        for diameter in [0.012, 0.02] {
            let cup = Cup {
                diameter,
                ..Cup::default()
            };
            let found = plan(&inputs, &cup, &PlanOptions::default()).unwrap();
            for grasp in found
                .grasps
                .iter()
                .filter(|grasp| matches!(grasp.source, Source::BothViews { .. }))
            {
                let (off, angle) = errors(grasp, &solved[0].captured);
                println!("{}: {:+.2} mm, {angle:.2} degrees", folder.display(), 1e3 * off);
                lengths.push(off.abs());
                angles.push(angle);
                names.push(folder.file_name().unwrap().to_owned());
            }
        }
    }
    names.dedup();
    assert!(
        names.len() >= 5 && lengths.len() >= 20,
        "{} grasps on {names:?}",
        lengths.len()
    );
    let found = [0.5, 0.95].map(|share| (1e3 * quantile(&mut lengths, share), quantile(&mut angles, share)));
    println!("{} grasps, median and 95 %: {found:.2?}", lengths.len());
    assert!(found[0].0 < 1.0 && found[1].0 < 3.0, "{found:?}");
    assert!(found[0].1 < 5.0 && found[1].1 < 12.0, "{found:?}");
}
