//! Pictures for people.

use crate::error::ImagingError;
use crate::image::{Image, Pixel};

/// Colours of a normal map: each component from -1..1 to 0..255 as `(n + 1) / 2`, x red, y green, z blue.
///
/// In the base frame z points up, so a level table is the usual light blue (128, 128, 255), a slope facing base x
/// turns red and one facing base y green. A pixel without a measurement (NaN) is black.
pub fn normal_picture(normals: &Image<[f32; 3]>) -> Image<[u8; 3]> {
    normals.map(|normal| {
        if normal.iter().all(|n| n.is_finite()) {
            normal.map(|n| ((n + 1.0) * 0.5 * 255.0).round().clamp(0.0, 255.0) as u8)
        } else {
            [0; 3]
        }
    })
}

/// Gray values with `black` and below at 0 and `white` and above at 255; NaN is black. `black` may exceed `white` for a
/// negative.
pub fn gray_picture<T: Pixel + Into<f32>>(image: &Image<T>, black: f32, white: f32) -> Result<Image<u8>, ImagingError> {
    let scale = 255.0 / (white - black);
    if !scale.is_finite() {
        return Err(ImagingError::OutOfRange {
            what: "white point minus black point",
            value: f64::from(white - black),
            allowed: "finite and not zero",
        });
    }
    // The cast turns NaN into 0 and clamps the rest.
    Ok(image.map(|&value| ((value.into() - black) * scale).round() as u8))
}

/// The same gray in all three colours.
pub fn gray_to_rgb(image: &Image<u8>) -> Image<[u8; 3]> {
    image.map(|&gray| [gray; 3])
}

/// Pictures side by side in rows of `columns`, `gap` white pixels between them; each cell has the largest picture's
/// size. None when there is nothing to show.
pub fn contact_sheet(pictures: &[Image<[u8; 3]>], columns: usize, gap: usize) -> Option<Image<[u8; 3]>> {
    let columns = columns.min(pictures.len());
    let cell_width = pictures.iter().map(Image::width).max()? + gap;
    let cell_height = pictures.iter().map(Image::height).max()? + gap;
    if columns == 0 {
        return None;
    }
    let (width, height) = (
        columns * cell_width - gap,
        pictures.len().div_ceil(columns) * cell_height - gap,
    );
    let mut sheet = Image::filled(width, height, [255_u8; 3]);
    for (index, picture) in pictures.iter().enumerate() {
        let (left, top) = (index % columns * cell_width, index / columns * cell_height);
        for (y, row) in picture.rows().enumerate() {
            let start = (top + y) * width + left;
            sheet.pixels_mut()[start..start + row.len()].copy_from_slice(row);
        }
    }
    Some(sheet)
}
