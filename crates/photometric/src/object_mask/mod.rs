//! Which pixels show an object, from the capture itself: the mat is dark, objects are light.

mod components;
mod split;

use geometry::nalgebra::Vector3;
use imaging::{Image, Mask};
use rayon::prelude::*;

use crate::error::PhotometricError;
use crate::solution::Capture;

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectMaskOptions {
    /// Middle of the mat, base frame, metres: (x, y).
    pub mat_centre: [f64; 2],
    /// Its sides along x and y, metres; what lies beyond is table and not looked at.
    pub mat_size: [f64; 2],
    /// Groups of fewer pixels are specks, whether object or hole.
    pub least_pixels: usize,
}

impl Default for ObjectMaskOptions {
    fn default() -> Self {
        Self {
            mat_centre: [0.43, 0.0],
            mat_size: [0.46, 0.61],
            least_pixels: 150,
        }
    }
}

impl ObjectMaskOptions {
    fn check(&self) -> Result<(), PhotometricError> {
        let within = PhotometricError::require_within;
        for value in self.mat_centre {
            within("middle of the mat", value, -10.0..=10.0, "-10 to 10 m")?;
        }
        let mut sizes = self.mat_size.into_iter();
        sizes.try_for_each(|value| within("side of the mat", value, 1e-3..=10.0, "0.001 to 10 m"))
    }
}

/// Objects reflect at least this many times what the mat does; the darkest prints reflect 2.5 times as much.
const OVER_MAT: f32 = 1.9;

/// The pixels that show an object. Nothing but mat, or nothing lit, gives an empty mask.
///
/// Every sample is divided by the light that a level patch gets there; an object is where the largest of these over the
/// lights is well over the mat's, whose level is that of the darker class of pixels (Otsu 1979).
///
/// # Errors
/// An image of some panel is missing; rays of another size; options out of range.
pub fn object_mask(capture: &Capture<'_>, options: &ObjectMaskOptions) -> Result<Mask, PhotometricError> {
    options.check()?;
    capture.view.require_rays(capture.rays)?;
    let reflectances = smoothed(&reflectances(capture, options)?);
    let threshold = split::threshold(reflectances.pixels(), OVER_MAT, brightest_is_bright(capture));
    let mut inside: Vec<bool> = reflectances.pixels().iter().map(|&value| value > threshold).collect();
    let (width, height) = (reflectances.width(), reflectances.height());
    components::drop_small(&mut inside, width, options.least_pixels, true);
    components::drop_small(&mut inside, width, options.least_pixels, false);
    let mut image = Image::filled(width, height, 0_u8);
    for (pixel, inside) in image.pixels_mut().iter_mut().zip(inside) {
        *pixel = u8::from(inside);
    }
    Ok(Mask::from_nonzero(&image))
}

/// Whether an object can be there at all: exposures are set so that objects are bright, a mat alone stays dark.
fn brightest_is_bright(capture: &Capture<'_>) -> bool {
    let full_scale = capture.stack.saturation();
    let images = capture
        .stack
        .channels()
        .filter_map(|channel| capture.stack.light(channel));
    let bright: usize = images
        .map(|image| image.pixels().iter().filter(|&&raw| raw > full_scale / 8).count())
        .max()
        .unwrap_or(0);
    bright > 0
}

/// Largest sample over level irradiance, pixel by pixel; 0 beyond the mat.
fn reflectances(capture: &Capture<'_>, options: &ObjectMaskOptions) -> Result<Image<f32>, PhotometricError> {
    let panels = capture.rig.panels();
    let centre = geometry::nalgebra::Point3::new(options.mat_centre[0], options.mat_centre[1], 0.0);
    // One level irradiance a light is enough: over the mat they change by less than objects and mat differ.
    let images = panels.iter().map(|panel| {
        let image = capture
            .stack
            .light(panel.channel)
            .ok_or_else(|| PhotometricError::NoImage {
                channel: panel.channel,
                present: capture.stack.channels().collect(),
            });
        let level = panel.irradiance(&centre, &Vector3::z());
        image.map(|image| (image.pixels(), (1.0 / level) as f32))
    });
    let images = usable(images.collect::<Result<Vec<_>, _>>()?, capture.stack.saturation());
    let (width, height) = (capture.stack.width(), capture.stack.height());
    let dark = capture.stack.dark();
    let mut image = Image::filled(width, height, 0.0_f32);
    let is_whole_mat = corners(width, height)
        .into_iter()
        .all(|index| is_over_mat(capture, options, index));
    let rows = image
        .pixels_mut()
        .par_chunks_exact_mut(width)
        .with_min_len(16)
        .enumerate();
    rows.for_each(|(y, row)| {
        for (pixels, scale) in &images {
            brighten(row, &pixels[y * width..(y + 1) * width], dark.row(y), *scale);
        }
        if !is_whole_mat {
            for (x, value) in row.iter_mut().enumerate() {
                if !is_over_mat(capture, options, y * width + x) {
                    *value = 0.0;
                }
            }
        }
    });
    Ok(image)
}

/// A light that saturates most of its image says nothing of what is mat; all of them when none is left.
fn usable(images: Vec<(&[u16], f32)>, saturation: u16) -> Vec<(&[u16], f32)> {
    let is_white = |pixels: &[u16]| 2 * pixels.iter().filter(|&&raw| raw >= saturation).count() > pixels.len();
    let kept: Vec<_> = images.iter().copied().filter(|(pixels, _)| !is_white(pixels)).collect();
    if kept.is_empty() { images } else { kept }
}

/// The larger of what is there and what one light says.
fn brighten(row: &mut [f32], lit: &[u16], dark: &[u16], scale: f32) {
    for ((value, &lit), &dark) in row.iter_mut().zip(lit).zip(dark) {
        *value = value.max((f32::from(lit) - f32::from(dark)) * scale);
    }
}

/// The image's corners: the mat is convex, so when it holds these it holds all between.
fn corners(width: usize, height: usize) -> [usize; 4] {
    let last = (height - 1) * width;
    [0, width - 1, last, last + width - 1]
}

fn is_over_mat(capture: &Capture<'_>, options: &ObjectMaskOptions, index: usize) -> bool {
    let ideal = capture.rays.ideal().pixels()[index];
    let point = capture
        .view
        .point_at_depth(ideal, capture.view.depth_of_plane(ideal, 0.0));
    let within = |value: f64, axis: usize| (value - options.mat_centre[axis]).abs() < options.mat_size[axis] / 2.0;
    within(point.x, 0) && within(point.y, 1)
}

/// Mean of 3 x 3 pixels: the mat is barely brighter than the noise.
fn smoothed(image: &Image<f32>) -> Image<f32> {
    let (width, height) = (image.width(), image.height());
    let mut smooth = Image::filled(width, height, 0.0_f32);
    let rows = smooth
        .pixels_mut()
        .par_chunks_exact_mut(width)
        .with_min_len(16)
        .enumerate();
    rows.for_each(|(y, row)| {
        let near = y.saturating_sub(1)..(y + 2).min(height);
        let count = near.len() as f32;
        let mut sums = vec![0.0; width];
        for y in near {
            for (sum, value) in sums.iter_mut().zip(image.row(y)) {
                *sum += value / count;
            }
        }
        for (x, value) in row.iter_mut().enumerate() {
            let near = &sums[x.saturating_sub(1)..(x + 2).min(width)];
            *value = near.iter().sum::<f32>() / near.len() as f32;
        }
    });
    smooth
}
