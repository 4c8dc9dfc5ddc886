//! Pictures for people: ours, truth and their difference, a row per light.

use std::path::Path;

use anyhow::Context;
use imaging::{Image, contact_sheet, encode_png, gray_picture, gray_to_rgb};

use super::comparison::Comparison;

/// Pictures are made at least this much smaller than the images, pixels of a side.
const SIDE: usize = 384;
/// White pixels between pictures.
const GAP: usize = 4;
/// A difference of this share of white is black or white.
const DIFFERENCE: f32 = 0.1;

pub(super) fn write(comparison: &Comparison, path: &Path) -> anyhow::Result<()> {
    let mut pictures = Vec::new();
    for (ours, truth) in comparison.ours.iter().zip(&comparison.truth) {
        let (ours, truth) = (smaller(ours), smaller(truth));
        let white = truth.pixels().iter().fold(1.0_f32, |a, &b| a.max(b));
        let difference = ours.pixels().iter().zip(truth.pixels()).map(|(a, b)| (a - b) / white);
        let difference = Image::new(truth.width(), truth.height(), difference.collect())?;
        for image in [&ours, &truth] {
            // The root shows what is in the shadows.
            let root = image.map(|value| (value / white).max(0.0).sqrt());
            pictures.push(gray_to_rgb(&gray_picture(&root, 0.0, 1.0)?));
        }
        pictures.push(gray_to_rgb(&gray_picture(&difference, -DIFFERENCE, DIFFERENCE)?));
    }
    let sheet = contact_sheet(&pictures, 3, GAP).context("no images to show")?;
    std::fs::write(path, encode_png(&sheet)?).with_context(|| format!("cannot write {}", path.display()))
}

fn smaller(image: &Image<f32>) -> Image<f32> {
    let bin = (image.width().min(image.height()) / SIDE).max(1);
    Image::from_fn(image.width() / bin, image.height() / bin, |x, y| {
        let rows = (y * bin..(y + 1) * bin).map(|row| &image.row(row)[x * bin..(x + 1) * bin]);
        rows.flatten().sum::<f32>() / (bin * bin) as f32
    })
}
