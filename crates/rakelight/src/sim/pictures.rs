//! What the cameras of a world would see, as pictures.

use std::path::Path;

use anyhow::Context;
use imaging::{Image, PngPixel, contact_sheet, encode_png, gray_picture, gray_to_rgb, normal_picture};
use sim::render::{RenderOptions, RenderedView, render};
use sim::sensor::{Exposure, LightState, Region};
use sim::world::{Camera, World};

/// As on the rig.
const EXPOSURE_SECONDS: f64 = 0.0025;
/// Columns of the sheet with all lights, and of a picture on it at most.
const SHEET_COLUMNS: usize = 4;
const SHEET_WIDTH: usize = 384;

/// A folder for each camera: `dark.png`, `L1.png` to `L7.png` (16 bits, as the sensor gives them), `lights.png` (all of
/// them, small), and the truth: `normals.png`, `depth.png` (white is near) and `labels.png`.
pub(super) fn write(world: &World, folder: &Path) -> anyhow::Result<()> {
    for camera in &world.cameras {
        let folder = folder.join(&camera.name);
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let view = world.view(camera, [camera.binning; 2])?;
        let rendered = render(&world.scene, &view, &RenderOptions::default())?;
        write_lights(camera, world.seed, &rendered, &folder)?;
        write_truth(&rendered, &folder)?;
        println!("{}", folder.display());
    }
    Ok(())
}

fn write_lights(camera: &Camera, seed: u64, rendered: &RenderedView, folder: &Path) -> anyhow::Result<()> {
    let exposure = Exposure {
        seconds: EXPOSURE_SECONDS,
        gain_decibels: 0.0,
        black_level: 0,
        averaged: camera.binning * camera.binning,
        region: Region {
            x: 0,
            y: 0,
            width: rendered.ambient.width(),
            height: rendered.ambient.height(),
        },
    };
    let mut sheet = Vec::new();
    for panel in 0..=7 {
        let noise = seed.wrapping_mul(8).wrapping_add(u64::from(panel));
        let image = camera
            .sensor
            .expose(rendered, LightState::single(panel), &exposure, noise)?;
        let name = if panel == 0 {
            "dark".to_owned()
        } else {
            format!("L{panel}")
        };
        save(&image, &folder.join(name + ".png"))?;
        sheet.push(gray_to_rgb(&gray_picture(&small(&image), 0.0, 65_535.0)?));
    }
    if let Some(sheet) = contact_sheet(&sheet, SHEET_COLUMNS, 4) {
        save(&sheet, &folder.join("lights.png"))?;
    }
    Ok(())
}

fn write_truth(rendered: &RenderedView, folder: &Path) -> anyhow::Result<()> {
    let depth = rendered.depth.pixels().iter().filter(|depth| depth.is_finite());
    let (near, far) = depth.fold((f32::MAX, 0.0), |(near, far): (f32, f32), depth| {
        (near.min(*depth), far.max(*depth))
    });
    save(&normal_picture(&rendered.normals), &folder.join("normals.png"))?;
    if near < far {
        save(&gray_picture(&rendered.depth, far, near)?, &folder.join("depth.png"))?;
    }
    save(&rendered.labels, &folder.join("labels.png"))
}

/// Every n-th pixel.
fn small(image: &Image<u16>) -> Image<u16> {
    let step = image.width().div_ceil(SHEET_WIDTH);
    let pixels = image.pixels();
    Image::from_fn(image.width() / step, image.height() / step, |x, y| {
        pixels[y * step * image.width() + x * step]
    })
}

fn save<T: PngPixel>(image: &Image<T>, path: &Path) -> anyhow::Result<()> {
    let png = encode_png(image)?;
    std::fs::write(path, png).with_context(|| format!("cannot write {}", path.display()))
}
