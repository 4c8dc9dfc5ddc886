//! Depth edges of captures with truth: pictures, figures and times.
//!
//! `edges SCENES LIGHTS OUT`: a folder of captures, a calibration of the lights, a folder for pictures. Without
//! arguments the captures and the calibration that come with the project, and no pictures.

use std::path::{Path, PathBuf};
use std::time::Instant;

use calibration_files::LightsFile;
use imaging::{Image, Mask, encode_png};
use photometric::{
    Capture, EdgeInput, EdgeMap, EdgeOptions, LightRig, ObjectMaskOptions, PixelRays, SensorNoise, View, object_mask,
    occlusion_edges,
};
use rig_scenes::{CapturedView, SceneFolder, find_scenes};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let or = |at: usize, default: &str| arguments.get(at).cloned().unwrap_or_else(|| root.join(default));
    let scenes = or(0, "../shared/data/rig/objects");
    let rig = LightsFile::read(&or(1, "launch_configs/calibration/lights.yaml"))?.rig()?;
    for folder in find_scenes(&scenes)? {
        let scene = SceneFolder::open(&folder)?;
        for view in scene.views()? {
            evaluate(&scene.name(), &view, &rig, arguments.get(2).map(PathBuf::as_path))?;
        }
    }
    for size in [1000, 1536] {
        report_times(size, &rig)?;
    }
    Ok(())
}

fn evaluate(name: &str, captured: &CapturedView, rig: &LightRig, out: Option<&Path>) -> Result<(), Failure> {
    let rays = PixelRays::new(&captured.view.camera);
    let capture = Capture {
        stack: &captured.stack,
        view: &captured.view,
        rays: &rays,
        rig,
        noise: SensorNoise::RIG,
    };
    let mask = object_mask(&capture, &ObjectMaskOptions::default())?;
    let input = EdgeInput {
        capture: &capture,
        mask: Some(&mask),
        depth: None,
    };
    let found = occlusion_edges(&input, &EdgeOptions::default())?;
    let outline = outline(&captured.mask);
    let covered = outline.iter().filter(|&&(x, y)| is_near(&found.edges, x, y, 2)).count();
    let inside = pixels(&found.edges).filter(|&(x, y)| is_deep(&captured.mask, x, y, 4));
    println!(
        "{name:12} {} outline within 2 px {:5.1} %, edge pixels {:4}, of them inside the object {}",
        captured.camera,
        100.0 * covered as f64 / outline.len().max(1) as f64,
        found.edges.count(),
        inside.count(),
    );
    if let Some(out) = out {
        let path = out.join(format!("{name}_{}.png", captured.camera));
        std::fs::write(path, encode_png(&picture(captured, &found)?)?)?;
    }
    Ok(())
}

fn pixels(mask: &Mask) -> impl Iterator<Item = (usize, usize)> + '_ {
    let (width, height) = (mask.as_image().width(), mask.as_image().height());
    let all = (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
    all.filter(|&(x, y)| mask.contains(x, y))
}

/// Pixels of the mask beside one that is not in it.
fn outline(mask: &Mask) -> Vec<(usize, usize)> {
    pixels(mask).filter(|&(x, y)| !is_deep(mask, x, y, 1)).collect()
}

fn near(x: usize, y: usize, radius: usize) -> impl Iterator<Item = (usize, usize)> {
    let around = move |middle: usize| middle.saturating_sub(radius)..=middle + radius;
    around(y).flat_map(move |y| around(x).map(move |x| (x, y)))
}

fn is_near(mask: &Mask, x: usize, y: usize, radius: usize) -> bool {
    near(x, y, radius).any(|(x, y)| mask.contains(x, y))
}

fn is_deep(mask: &Mask, x: usize, y: usize, radius: usize) -> bool {
    near(x, y, radius).all(|(x, y)| mask.contains(x, y))
}

/// The overhead image in gray, edges in red.
fn picture(captured: &CapturedView, found: &EdgeMap) -> Result<Image<[u8; 3]>, Failure> {
    let lit = captured.stack.light(7).ok_or("no image of L7")?;
    let most = lit.pixels().iter().copied().max().unwrap_or(1).max(1);
    Ok(Image::from_fn(lit.width(), lit.height(), |x, y| {
        if found.edges.contains(x, y) {
            return [255, 40, 40];
        }
        let gray = f32::from(lit.pixels()[y * lit.width() + x]) / f32::from(most);
        [(gray * 200.0) as u8; 3]
    }))
}

/// Times over the disc's capture, enlarged to fill the image.
fn report_times(size: usize, rig: &LightRig) -> Result<(), Failure> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/rig/objects/disc");
    let captured = SceneFolder::open(&path)?.views()?.swap_remove(0);
    let camera = captured.view.camera.enlarged(2)?;
    let view = View {
        camera: camera.crop(0, 0, size, size)?,
        ..captured.view
    };
    let stack = imaging::ExposureStack::new(&rig.channels(), images(&captured, size)?, captured.stack.saturation())?;
    let rays = PixelRays::new(&view.camera);
    let capture = Capture {
        stack: &stack,
        view: &view,
        rays: &rays,
        rig,
        noise: SensorNoise::RIG,
    };
    let mask = object_mask(&capture, &ObjectMaskOptions::default())?;
    for (what, mask) in [("object", Some(&mask)), ("everything", None)] {
        let input = EdgeInput {
            capture: &capture,
            mask,
            depth: None,
        };
        time(&format!("{size} x {size}, {what}"), &input)?;
    }
    Ok(())
}

fn time(what: &str, input: &EdgeInput<'_>) -> Result<(), Failure> {
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let mut times = Vec::new();
        for _ in 0..15 {
            let start = Instant::now();
            pool.install(|| occlusion_edges(input, &EdgeOptions::default()))?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        println!(
            "{what}, {threads} threads: median {:.1} ms, least {:.1} ms",
            times[7], times[0]
        );
    }
    Ok(())
}

fn images(captured: &CapturedView, size: usize) -> Result<Vec<(u8, Image<u16>)>, Failure> {
    let lit = captured
        .stack
        .channels()
        .filter_map(|channel| Some((channel, captured.stack.light(channel)?)));
    std::iter::once((0, captured.stack.dark()))
        .chain(lit)
        .map(|(channel, image)| Ok((channel, image.enlarge(2)?.crop(0, 0, size, size)?)))
        .collect()
}
