//! A capture as pictures: every image as it is, and one sheet for each camera to look at.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use imaging::{Image, PngPixel, contact_sheet, gray_picture, gray_to_rgb, write_png};

use super::receiver::Frames;
use crate::image_message::mono16;

/// The dark frame and L1 to L3 above L4 to L7.
const COLUMNS: usize = 4;
const GAP: usize = 4;

/// Writes `FOLDER/ID/CAMERA_INDEX_LIGHT.png`, 16 bits, and `FOLDER/ID_CAMERA.png`, 8 bits, and gives the latter.
pub(super) fn write(folder: &Path, capture_id: &str, frames: &Frames) -> anyhow::Result<Vec<PathBuf>> {
    let originals = folder.join(capture_id);
    fs::create_dir_all(&originals).with_context(|| format!("cannot create {}", originals.display()))?;
    let mut sheets = Vec::new();
    for (camera, frames) in frames {
        let images: Vec<Image<u16>> = frames
            .iter()
            .map(|frame| mono16(&frame.image))
            .collect::<anyhow::Result<_>>()?;
        for (frame, image) in frames.iter().zip(&images) {
            let exposure = &frame.exposure;
            let name = format!("{camera}_{}_{}.png", exposure.index, light(exposure.channel));
            write_file(&originals.join(name), image)?;
        }
        let path = folder.join(format!("{capture_id}_{camera}.png"));
        write_file(&path, &sheet(&images)?)?;
        sheets.push(path);
    }
    Ok(sheets)
}

/// The name of a channel.
pub(super) fn light(channel: u8) -> String {
    match channel {
        0 => "dark".into(),
        number => format!("L{number}"),
    }
}

/// All images side by side in the order of the sequence, linear, the brightest pixel of all white.
fn sheet(images: &[Image<u16>]) -> anyhow::Result<Image<[u8; 3]>> {
    let brightest = images.iter().flat_map(Image::pixels).max().copied().unwrap_or(0).max(1);
    let gray = |image: &Image<u16>| Ok(gray_to_rgb(&gray_picture(image, 0.0, f32::from(brightest))?));
    let pictures: Vec<_> = images.iter().map(gray).collect::<anyhow::Result<_>>()?;
    contact_sheet(&pictures, COLUMNS, GAP).context("a capture without images")
}

fn write_file<T: PngPixel>(path: &Path, image: &Image<T>) -> anyhow::Result<()> {
    let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut writer = BufWriter::new(file);
    write_png(image, &mut writer)?;
    writer
        .into_inner()
        .map(drop)
        .with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_scales_all_images_alike_to_the_brightest() {
        let images: Vec<Image<u16>> = [0, 100, 50, 200, 25].map(|level| Image::filled(3, 2, level)).into();
        let sheet = sheet(&images).unwrap();
        assert_eq!((sheet.width(), sheet.height()), (4 * 3 + 3 * GAP, 2 * 2 + GAP));
        let levels: Vec<u8> = [(0, 0), (7, 0), (14, 0), (21, 0), (0, 6)]
            .map(|(x, y)| sheet.get(x, y).unwrap()[0])
            .into();
        assert_eq!(levels, [0, 128, 64, 255, 32]);
    }

    #[test]
    fn lights_are_named_as_on_the_rig() {
        assert_eq!((light(0).as_str(), light(7).as_str()), ("dark", "L7"));
    }
}
