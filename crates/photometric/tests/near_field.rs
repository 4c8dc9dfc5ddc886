//! Calibration and normals under near panels: on captures with truth, and on what must not go wrong.

mod common;

use std::path::{Path, PathBuf};

use common::ball::{GAIN, angle, ball, ball_stack, solve, view};
use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3};
use imaging::{ExposureStack, Image, Mask};
use photometric::{
    CalibrationOptions, Capture, LightRig, NearFieldOptions, NormalSolution, ObjectMaskOptions, PhotometricError,
    PixelRays, ReferenceOptions, SensorNoise, TargetView, View, calibrate_lights, near_field_normals, object_mask,
    reference_normals,
};
use rig_scenes::{CapturedView, SceneFolder, find_scenes};

fn shared(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/rig")
        .join(name);
    if folder.exists() {
        return Some(folder);
    }
    println!("SKIPPED: {} is missing", folder.display());
    None
}

fn ball_error(view: &View, solution: &NormalSolution) -> f64 {
    let mut errors = Vec::new();
    for y in 0..view.camera.height() {
        for x in 0..view.camera.width() {
            let Some((_, normal)) = ball(view, [x as f64, y as f64]) else {
                continue;
            };
            if normal.z > 0.3 {
                errors.push(angle(*solution.normals.get(x, y).unwrap(), &normal));
            }
        }
    }
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn a_ball_comes_out_round_at_any_brightness() {
    let (view, rig) = (view(192), LightRig::nominal());
    for scale in [1.0, 0.3] {
        let (mask, solution) = solve(&ball_stack(&view, &rig, scale), &view, &rig);
        let error = ball_error(&view, &solution);
        println!(
            "ball at {scale}: {error:.2} degrees, gain {:.0}, {} pixels",
            solution.gain,
            mask.count()
        );
        assert!(error < 2.5, "{error}");
        assert!((solution.gain / (scale * GAIN) - 1.0).abs() < 0.04, "{}", solution.gain);
    }
}

#[test]
fn one_thread_or_two_give_the_same() {
    let (view, rig) = (view(64), LightRig::nominal());
    let stack = ball_stack(&view, &rig, 1.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (_, solution) = pool.install(|| solve(&stack, &view, &rig));
        solution
            .normals
            .pixels()
            .iter()
            .map(|n| n.map(f32::to_bits))
            .collect::<Vec<_>>()
    };
    assert!(with(1) == with(2));
}

#[test]
fn a_dark_capture_and_one_of_a_single_pixel_give_nothing_and_no_panic() {
    let rig = LightRig::nominal();
    let flat = |view: &View, value: u16| {
        let image = || Image::filled(view.camera.width(), view.camera.height(), value);
        let images = (0..=7_u8).map(|channel| (channel, image()));
        ExposureStack::new(&rig.channels(), images, 65_520).unwrap()
    };
    for (size, value) in [(32, 300), (1, 300), (1, 65_535), (32, 65_535)] {
        let view = view(size);
        let (_, solution) = solve(&flat(&view, value), &view, &rig);
        assert!(
            solution.normals.pixels().iter().all(|n| n[0].is_nan()),
            "{size} {value}"
        );
        assert!(solution.confidence.pixels().iter().all(|&c| c <= 0.0));
    }
}

#[test]
fn a_missing_light_is_named() {
    let (view, rig) = (view(16), LightRig::nominal());
    let image = || Image::filled(16, 16, 1000_u16);
    let stack = ExposureStack::new(&[1, 2, 3], (0..=3_u8).map(|channel| (channel, image())), 65_520).unwrap();
    let rays = PixelRays::new(&view.camera);
    let capture = Capture {
        stack: &stack,
        view: &view,
        rays: &rays,
        rig: &rig,
        noise: SensorNoise::RIG,
    };
    let mask = Mask::from_nonzero(&Image::filled(16, 16, 1));
    let error = near_field_normals(&capture, &mask, None, NearFieldOptions::default()).unwrap_err();
    assert!(matches!(error, PhotometricError::NoImage { channel: 4, .. }), "{error}");
    let error = object_mask(&capture, &ObjectMaskOptions::default()).unwrap_err();
    assert!(matches!(error, PhotometricError::NoImage { channel: 4, .. }), "{error}");
}

/// Calibration targets as captured, with what must live as long as their views.
fn targets(folder: &Path) -> Vec<(String, PixelRays, CapturedView)> {
    let scenes = find_scenes(folder).unwrap();
    let of_scene = |path: &PathBuf| {
        let scene = SceneFolder::open(path).unwrap();
        let views = scene.views().unwrap();
        views
            .into_iter()
            .map(move |view| (scene.name(), PixelRays::new(&view.view.camera), view))
    };
    scenes.iter().flat_map(of_scene).collect()
}

fn calibrated_on(captures: &[(String, PixelRays, CapturedView)]) -> photometric::LightCalibration {
    let mut views = Vec::new();
    for (name, rays, view) in captures {
        views.push(TargetView {
            placement: name,
            camera: &view.camera,
            stack: &view.stack,
            view: &view.view,
            rays,
        });
    }
    calibrate_lights(&views, &CalibrationOptions::RIG).unwrap()
}

/// The published method's mean angle over the pyramid of the first camera.
fn reference_error(calibration: &photometric::LightCalibration) -> Option<f64> {
    let scene = SceneFolder::open(&shared("objects/pyramid")?).unwrap();
    let view = scene.views().unwrap().swap_remove(0);
    let rays = PixelRays::new(&view.view.camera);
    let capture = Capture {
        stack: &view.stack,
        view: &view.view,
        rays: &rays,
        rig: &calibration.rig,
        noise: SensorNoise::RIG,
    };
    let options = ReferenceOptions::default();
    let solution = reference_normals(&capture, &view.mask, &calibration.polynomials, &options).unwrap();
    Some(mean_error(&solution, &view))
}

fn mean_error(solution: &NormalSolution, view: &CapturedView) -> f64 {
    let truth = view.truth.as_ref().unwrap();
    let pairs = solution.normals.pixels().iter().zip(truth.normals.pixels());
    let inside = view
        .mask
        .as_image()
        .pixels()
        .iter()
        .zip(pairs)
        .filter(|(inside, _)| **inside != 0);
    let errors: Vec<f64> = inside
        .map(|(_, (found, truth))| angle(*found, &Vector3::from(truth.map(f64::from))))
        .collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// Mean angle over the object of one scene's first camera.
fn scene_error(name: &str, rig: &LightRig) -> Option<f64> {
    let scene = SceneFolder::open(&shared(&format!("objects/{name}"))?).unwrap();
    let view = scene.views().unwrap().swap_remove(0);
    let (_, solution) = solve(&view.stack, &view.view, rig);
    Some(mean_error(&solution, &view))
}

#[test]
fn lights_calibrated_from_hemispheres_solve_path_traced_objects() {
    let Some(folder) = shared("calibration") else { return };
    let mut captures = targets(&folder);
    // One placement is said to be where it is not.
    let wrong = captures[0].0.clone();
    for capture in captures.iter_mut().filter(|capture| capture.0 == wrong) {
        let pose = &mut capture.2.view.base_from_camera;
        let shift = RigidTransform::from_parts(Vector3::new(0.0, 0.0, 0.03), UnitQuaternion::identity());
        *pose = shift * *pose;
    }
    let calibration = calibrated_on(&captures);
    assert_eq!(calibration.failure, None);
    let dropped: Vec<&str> = calibration
        .placements
        .iter()
        .filter(|placement| placement.dropped.is_some())
        .map(|placement| placement.placement.as_str())
        .collect();
    assert_eq!(dropped, [wrong.as_str()], "{:?}", calibration.placements);
    for light in &calibration.lights {
        println!("{light:?}");
        assert!(light.median_sigmas < 1.0 && light.rms_share < 0.08, "{light:?}");
    }
    for (name, allowed) in [
        ("pyramid", 1.25),
        ("octagon2", 3.5),
        ("plate_flat", 0.5),
        ("wedge_flat", 1.5),
        ("spot", 6.0),
    ] {
        let Some(error) = scene_error(name, &calibration.rig) else {
            return;
        };
        println!("{name} C1: {error:.2} degrees, allowed are {allowed}");
        assert!(error < allowed, "{name}: {error}");
    }
}

#[test]
fn the_published_method_does_what_it_is_known_for() {
    let Some(folder) = shared("calibration") else { return };
    let calibration = calibrated_on(&targets(&folder));
    let Some(error) = reference_error(&calibration) else {
        return;
    };
    println!("published method, pyramid C1: {error:.2} degrees");
    // 13 to 29 degrees were published for ten real objects; this one is an easy one, without noise of a real rig.
    assert!((3.0..30.0).contains(&error), "{error}");
}

#[test]
fn too_few_placements_are_refused() {
    let Some(folder) = shared("calibration") else { return };
    let captures: Vec<_> = targets(&folder).into_iter().take(6).collect();
    let views: Vec<TargetView<'_>> = captures
        .iter()
        .map(|(name, rays, view)| TargetView {
            placement: name,
            camera: &view.camera,
            stack: &view.stack,
            view: &view.view,
            rays,
        })
        .collect();
    let error = calibrate_lights(&views, &CalibrationOptions::RIG)
        .unwrap_err()
        .to_string();
    assert!(error.contains("placements") && error.contains("= 3"), "{error}");
}

/// The same images under other numbers: light `a` says it is `b` and the other way round.
fn exchanged(stack: &ExposureStack, a: u8, b: u8) -> ExposureStack {
    let source = |channel: u8| match channel {
        channel if channel == a => b,
        channel if channel == b => a,
        channel => channel,
    };
    with_lights(stack, |channel| stack.light(source(channel)).unwrap().clone())
}

fn with_lights(stack: &ExposureStack, image: impl Fn(u8) -> Image<u16>) -> ExposureStack {
    let lit = stack.channels().map(|channel| (channel, image(channel)));
    let images = std::iter::once((0, stack.dark().clone())).chain(lit);
    let channels: Vec<u8> = stack.channels().collect();
    ExposureStack::new(&channels, images, stack.saturation()).unwrap()
}

#[test]
fn exchanged_lights_raise_doubt() {
    let (view, rig) = (view(192), LightRig::nominal());
    let stack = ball_stack(&view, &rig, 1.0);
    assert_eq!(solve(&stack, &view, &rig).1.quality().doubt(), None);
    for (a, b) in [(1, 2), (1, 4), (2, 5), (3, 7)] {
        let (_, solution) = solve(&exchanged(&stack, a, b), &view, &rig);
        let quality = solution.quality();
        let doubt = quality.doubt().unwrap_or_default();
        assert!(doubt.contains("lights exchanged"), "{a} and {b}: {quality:?}");
    }
}

#[test]
fn a_saturated_light_is_done_without() {
    let (view, rig) = (view(192), LightRig::nominal());
    let stack = ball_stack(&view, &rig, 1.0);
    let white = || Image::filled(view.camera.width(), view.camera.height(), u16::MAX);
    let stack = with_lights(&stack, |channel| {
        if channel == 3 {
            white()
        } else {
            stack.light(channel).unwrap().clone()
        }
    });
    let (mask, solution) = solve(&stack, &view, &rig);
    assert!(mask.count() < 2000, "{}", mask.count());
    let error = ball_error(&view, &solution);
    assert!(error < 4.0, "{error}");
    assert!(solution.lights_used.pixels().iter().all(|&used| used <= 6));
}

#[test]
fn an_empty_table_is_solved_and_has_nothing_on_it() {
    let (view, rig) = (view(96), LightRig::nominal());
    // All of the ball's light is taken away: what is left is dark as the mat.
    let stack = ball_stack(&view, &rig, 0.0);
    let rays = PixelRays::new(&view.camera);
    let capture = Capture {
        stack: &stack,
        view: &view,
        rays: &rays,
        rig: &rig,
        noise: SensorNoise::RIG,
    };
    let found = photometric::solve_view(&capture, &photometric::SolveOptions::default()).unwrap();
    assert_eq!((found.normals.mask.count(), found.edges.edges.count()), (0, 0));
    assert!(found.normals.normals.pixels().iter().all(|normal| normal[2].is_nan()));
    assert!(found.depth.depth.pixels().iter().all(|depth| depth.is_nan()));
}

#[test]
fn numbers_that_are_none_are_refused_by_name() {
    let (view, rig) = (view(64), LightRig::nominal());
    let stack = ball_stack(&view, &rig, 1.0);
    let rays = PixelRays::new(&view.camera);
    let capture = Capture {
        stack: &stack,
        view: &view,
        rays: &rays,
        rig: &rig,
        noise: SensorNoise::RIG,
    };
    let refused = |change: fn(&mut photometric::SolveOptions)| {
        let mut options = photometric::SolveOptions::default();
        change(&mut options);
        photometric::solve_view(&capture, &options).unwrap_err().to_string()
    };
    let cases: [(&str, String); 6] = [
        ("coupling = NaN", refused(|options| options.normals.coupling = f32::NAN)),
        (
            "reflectance = 1.5",
            refused(|options| options.normals.reflectance = 1.5),
        ),
        ("stiffness = NaN", refused(|options| options.depth.stiffness = f32::NAN)),
        ("tolerance = 0", refused(|options| options.depth.tolerance = 0.0)),
        (
            "side of the mat = NaN",
            refused(|options| options.mask.mat_size[1] = f64::NAN),
        ),
        ("reach = NaN", refused(|options| options.edges.reach = f64::NAN)),
    ];
    for (wanted, error) in cases {
        assert!(error.starts_with(wanted), "{error}");
    }
}
