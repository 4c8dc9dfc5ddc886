//! Mean angle to the truth of every scene below a folder, under the rig as drawn (or the true rig, for diagnosis).
//!
//! `cargo run --release -p photometric --example near_field -- ../shared/data/rig/objects [true]`

use std::path::Path;
use std::time::Instant;

use geometry::Rectangle;
use geometry::nalgebra::{Unit, Vector3};
use photometric::{
    Bounce, CalibrationOptions, Capture, LightRig, NearFieldOptions, PanelModel, PixelRays, SensorNoise, TargetView, calibrate_lights, near_field_normals, object_mask, ObjectMaskOptions,
};
use rig_scenes::{SceneFolder, find_scenes};

fn true_rig(folder: &Path) -> LightRig {
    let text = std::fs::read_to_string(folder.join("scene.json")).expect("scene.json");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let lights = json["lights_reference"].as_array().expect("lights");
    let vector = |value: &serde_json::Value| {
        let mut numbers = value.as_array().expect("numbers").iter().map(|n| n.as_f64().expect("number"));
        Vector3::from_fn(|_, _| numbers.next().expect("three"))
    };
    let panels = lights.iter().enumerate().map(|(index, light)| PanelModel {
        channel: index as u8 + 1,
        rectangle: Rectangle {
            centre: vector(&light["centre"]).into(),
            facing: Unit::new_normalize(vector(&light["normal"])),
            right: Unit::new_normalize(vector(&light["right"])),
            size: [0.25, 0.1],
        },
        radiance: light["radiance_rel"].as_f64().expect("radiance"),
        bounce: Bounce { constant: std::env::var("B").map_or(0.0025, |v| v.parse().expect("number")), linear: Vector3::zeros() },
    });
    LightRig::new(panels.collect()).expect("a rig")
}

fn calibrated(folder: &Path) -> LightRig {
    let scenes: Vec<SceneFolder> = find_scenes(folder).expect("scenes").iter().map(|path| SceneFolder::open(path).expect("a scene")).collect();
    let captures: Vec<_> = scenes.iter().flat_map(|scene| scene.views().expect("views").into_iter().map(|view| (scene.name(), PixelRays::new(&view.view.camera), view))).collect();
    let views: Vec<TargetView<'_>> = captures.iter().map(|(name, rays, view)| TargetView { placement: name, camera: &view.camera, stack: &view.stack, view: &view.view, rays }).collect();
    let started = Instant::now();
    let calibration = calibrate_lights(&views, &CalibrationOptions::RIG).expect("calibrated");
    println!("calibrated in {:.1} s: {:?}", started.elapsed().as_secs_f64(), calibration.failure);
    for (report, scene) in calibration.placements.iter().zip(&scenes) { println!("{report:?} {:?}", scene.hemisphere().map(|target| target.centre)); }
    for report in &calibration.lights { println!("{report:?}"); }
    for panel in calibration.rig.panels() { println!("{:?} {:?} {:.3} {:?}", panel.rectangle.centre, panel.rectangle.facing, panel.radiance, panel.bounce); }
    judge(&calibration.rig, &true_rig(&folder.join("hemi00")));
    calibration.rig
}

/// Predicted irradiance against the true panels', one common factor removed.
fn judge(rig: &LightRig, truth: &LightRig) {
    let mut ratios = Vec::new();
    for x in 0..5 { for y in 0..7 { for z in 0..3 { for n in 0..7 {
        let point = geometry::nalgebra::Point3::new(0.25 + 0.09 * f64::from(x), -0.27 + 0.09 * f64::from(y), 0.03 * f64::from(z));
        let tilt: f64 = if n == 0 { 0.0 } else { 0.9 };
        let around = f64::from(n) * std::f64::consts::FRAC_PI_3;
        let normal = Vector3::new(tilt.sin() * around.cos(), tilt.sin() * around.sin(), tilt.cos());
        for (a, b) in rig.panels().iter().zip(truth.panels()) {
            let (a, b) = (a.direct(&point, &normal), b.direct(&point, &normal));
            if b > 0.005 { ratios.push((a / b).ln()); }
        }
    }}}}
    ratios.sort_by(f64::total_cmp);
    let middle = ratios[ratios.len() / 2];
    let mut off: Vec<f64> = ratios.iter().map(|r| (r - middle).abs()).collect();
    off.sort_by(f64::total_cmp);
    println!("irradiance against truth: median {:.2} %, p95 {:.2} %", 100.0 * off[off.len() / 2], 100.0 * off[off.len() * 95 / 100]);
}

fn main() {
    let folder = std::env::args().nth(1).expect("a folder of scenes");
    let fitted = calibrated(&Path::new(&folder).join("../calibration"));
    let diagnosis = std::env::args().nth(2).is_some_and(|word| word == "true");
    for path in find_scenes(Path::new(&folder)).expect("scenes") {
        let scene = SceneFolder::open(&path).expect("a scene");
        let rig = if diagnosis { true_rig(&path) } else { fitted.clone() };
        for view in scene.views().expect("views") {
            let Some(truth) = &view.truth else { continue };
            let rays = PixelRays::new(&view.view.camera);
            let capture = Capture { stack: &view.stack, view: &view.view, rays: &rays, rig: &rig, noise: SensorNoise::RIG };
            let started = Instant::now();
            let mask = object_mask(&capture, &ObjectMaskOptions::default()).expect("mask");
            let mask_seconds = started.elapsed().as_secs_f64();
            let missed = mask.as_image().pixels().iter().zip(view.mask.as_image().pixels()).filter(|(a, b)| **a == 0 && **b != 0).count();
            println!("  mask {:.3} s: {} of {}, missed {}", mask_seconds, mask.count(), view.mask.count(), missed);
            let solution = near_field_normals(&capture, &mask, None, &NearFieldOptions::default()).expect("solved");
            let seconds = started.elapsed().as_secs_f64();
            let mut by_used = [(0.0_f64, 0_usize); 9];
            let mut errors = Vec::new();
            for (index, (found, true_normal)) in solution.normals.pixels().iter().zip(truth.normals.pixels()).enumerate() {
                if view.mask.as_image().pixels()[index] == 0 { continue; }
                let dot: f32 = found.iter().zip(true_normal).map(|(a, b)| a * b).sum();
                let angle = if dot.is_nan() { 90.0 } else { f64::from(dot.clamp(-1.0, 1.0).acos().to_degrees()) };
                errors.push(angle);
                let used = usize::from(solution.lights_used.pixels()[index]);
                by_used[used].0 += angle;
                by_used[used].1 += 1;
            }
            errors.sort_by(f64::total_cmp);
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            let groups: Vec<String> = by_used.iter().map(|(sum, n)| format!("{:.0}%:{:.1}", 100.0 * *n as f64 / errors.len() as f64, sum / (*n).max(1) as f64)).collect();
            println!("{:14} {} mean {mean:6.2} median {:5.2} p95 {:5.1}  gain {:.0} {seconds:.2} s {} | {}", scene.name(), view.camera, errors[errors.len() / 2], errors[errors.len() * 95 / 100], solution.gain, errors.len(), groups.join(" "));
        }
    }
}
