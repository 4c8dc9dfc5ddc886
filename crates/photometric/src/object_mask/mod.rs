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

/// Objects reflect at least this many times what the mat does; the darkest prints reflect 2.5 times as much.
const OVER_MAT: f32 = 1.9;

/// The pixels that show an object. Nothing but mat, or nothing lit, gives an empty mask.
///
/// Every sample is divided by the light that a level patch gets there; an object is where the largest of these over the
/// lights is well over the mat's, whose level is that of the darker class of pixels (Otsu 1979).
///
/// # Errors
/// An image of some panel is missing; rays of another size.
pub fn object_mask(capture: &Capture<'_>, options: &ObjectMaskOptions) -> Result<Mask, PhotometricError> {
    capture.view.require_rays(capture.rays)?;
    let reflectances = smoothed(&reflectances(capture, options)?);
    let threshold = split::threshold(reflectances.pixels(), OVER_MAT, brightest_is_bright(capture));
    let mut inside: Vec<bool> = reflectances.pixels().iter().map(|&value| value > threshold).collect();
    let (width, height) = (reflectances.width(), reflectances.height());
    components::drop_small(&mut inside, width, options.least_pixels, true);
    components::drop_small(&mut inside, width, options.least_pixels, false);
    Ok(Mask::from_nonzero(&Image::from_fn(width, height, |x, y| {
        u8::from(inside[y * width + x])
    })))
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
    let images = images.collect::<Result<Vec<_>, _>>()?;
    let (width, height) = (capture.stack.width(), capture.stack.height());
    let dark = capture.stack.dark().pixels();
    let row = |y: usize| -> Vec<f32> {
        let of_pixel = |x: usize| {
            let index = y * width + x;
            if !is_over_mat(capture, options, index) {
                return 0.0;
            }
            let of_light =
                |(pixels, scale): &(&[u16], f32)| (f32::from(pixels[index]) - f32::from(dark[index])) * scale;
            images.iter().map(of_light).fold(0.0, f32::max)
        };
        (0..width).map(of_pixel).collect()
    };
    let values: Vec<f32> = (0..height).into_par_iter().flat_map_iter(row).collect();
    let mut image = Image::filled(width, height, 0.0);
    image.pixels_mut().copy_from_slice(&values);
    Ok(image)
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
    let mean = |x: usize, y: usize| {
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let (mut sum, mut count) = (0.0, 0.0);
        for row in rows {
            for value in &image.row(row)[x.saturating_sub(1)..(x + 2).min(width)] {
                sum += value;
                count += 1.0;
            }
        }
        sum / count
    };
    Image::from_fn(width, height, mean)
}
