//! Pictures of a solved view: what the camera saw, and the normals.

use std::path::Path;

use anyhow::Context;
use imaging::{Image, contact_sheet, encode_png, gray_picture, gray_to_rgb, normal_picture};
use photometric::ViewSolution;

use crate::captured::Captured;
use crate::relief::relief;

/// White pixels between the pictures of a sheet.
const GAP: usize = 6;

pub(super) fn write(folder: &Path, captured: &Captured, solution: &ViewSolution) -> anyhow::Result<()> {
    let name = format!("{}_{}", captured.id, captured.camera_name());
    let put = |what: &str, picture: &Image<[u8; 3]>| -> anyhow::Result<()> {
        let path = folder.join(format!("{name}_{what}.png"));
        std::fs::write(&path, encode_png(picture)?).with_context(|| format!("cannot write {}", path.display()))
    };
    let stack = &captured.stack;
    let white = f32::from(stack.saturation());
    let lit = stack.channels().filter_map(|channel| stack.light(channel));
    let images = std::iter::once(stack.dark()).chain(lit);
    let pictures = images.map(|image| Ok(gray_to_rgb(&gray_picture(image, 0.0, white)?)));
    let pictures = pictures.collect::<anyhow::Result<Vec<_>>>()?;
    if let Some(sheet) = contact_sheet(&pictures, 4, GAP) {
        put("lights", &sheet)?;
    }
    put("normals", &normal_picture(&solution.normals.normals))?;
    put(
        "confidence",
        &gray_to_rgb(&gray_picture(&solution.normals.confidence, 0.0, 1.0)?),
    )?;
    put("edges", &gray_to_rgb(solution.edges.edges.as_image()))?;
    put("relief", &gray_to_rgb(&relief(&solution.depth.depth)))
}
