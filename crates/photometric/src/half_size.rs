//! A capture at half the size: four pixels in one, for a first look at low cost.

use imaging::{ExposureStack, Image, Mask};
use rayon::prelude::*;

use crate::sensor_noise::SensorNoise;
use crate::solution::Capture;
use crate::view::{PixelRays, View};

/// Images smaller than this are looked at only once, pixels.
const SMALLEST: usize = 64;

/// What a [`Capture`] of half the size borrows from.
pub(crate) struct HalfSize {
    stack: ExposureStack,
    view: View,
    rays: PixelRays,
    noise: SensorNoise,
    pub(crate) mask: Mask,
}

impl HalfSize {
    /// None when the size is odd or small already, or a light has no image: the look at the whole image says which.
    pub(crate) fn of(capture: &Capture<'_>, mask: &Mask) -> Option<Self> {
        let (width, height) = (capture.stack.width(), capture.stack.height());
        if width.min(height) < SMALLEST {
            return None;
        }
        let camera = capture.view.camera.binned(2).ok()?;
        let noise = SensorNoise {
            electrons_per_dn: capture.noise.electrons_per_dn * 4.0,
            read_electrons: capture.noise.read_electrons * 2.0,
            step_dn: capture.noise.step_dn / 2.0,
        };
        let view = View {
            camera,
            base_from_camera: capture.view.base_from_camera,
        };
        let any = |a: u8, b: u8, c: u8, d: u8| a | b | c | d;
        Some(Self {
            stack: stack(capture)?,
            view,
            rays: capture.rays.binned(),
            noise,
            mask: Mask::from_nonzero(&quarters(mask.as_image(), any)),
        })
    }

    /// As a capture under the lights of the whole one.
    pub(crate) fn capture<'a>(&'a self, whole: &Capture<'a>) -> Capture<'a> {
        Capture {
            stack: &self.stack,
            view: &self.view,
            rays: &self.rays,
            rig: whole.rig,
            noise: self.noise,
        }
    }
}

/// Means of four pixels; one that is saturated spoils all four.
fn stack(capture: &Capture<'_>) -> Option<ExposureStack> {
    let saturation = capture.stack.saturation();
    let mean = |a: u16, b: u16, c: u16, d: u16| {
        if a.max(b).max(c).max(d) >= saturation {
            return u16::MAX;
        }
        ((u32::from(a) + u32::from(b) + u32::from(c) + u32::from(d) + 2) / 4) as u16
    };
    let channels = capture.rig.channels();
    let lit = channels
        .iter()
        .filter_map(|&channel| Some((channel, capture.stack.light(channel)?)));
    let images: Vec<_> = std::iter::once((imaging::DARK_CHANNEL, capture.stack.dark()))
        .chain(lit)
        .collect();
    let halve = |(channel, image): &(u8, &Image<u16>)| (*channel, quarters(image, mean));
    let halved: Vec<_> = images.par_iter().map(halve).collect();
    ExposureStack::new(&channels, halved, saturation).ok()
}

/// Every 2 x 2 pixels as one.
fn quarters<T: Copy>(image: &Image<T>, join: impl Fn(T, T, T, T) -> T) -> Image<T> {
    Image::from_fn(image.width() / 2, image.height() / 2, |x, y| {
        let (above, below) = (image.row(2 * y), image.row(2 * y + 1));
        join(above[2 * x], above[2 * x + 1], below[2 * x], below[2 * x + 1])
    })
}

/// Every pixel as 2 x 2.
pub(crate) fn doubled(image: &Image<f32>) -> Image<f32> {
    Image::from_fn(image.width() * 2, image.height() * 2, |x, y| image.row(y / 2)[x / 2])
}
