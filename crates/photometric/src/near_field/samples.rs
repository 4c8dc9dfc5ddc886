//! A capture's pixels as the solver wants them.

use glam::{Mat3, Vec3};
use imaging::Image;

use super::bounced::BouncedLight;
use super::candidates::Triple;
use super::lanes::{Lanes, MAX_PANELS, VectorLanes};
use super::light_field::{LightField, to_glam};
use super::pixel::Pixel;
use crate::error::PhotometricError;
use crate::solution::Capture;

/// Where a surface is taken to be before its depth is known: metres over the table, half of a usual object.
pub(crate) const USUAL_HEIGHT: f32 = 0.015;

/// Reads pixels of a capture.
pub(crate) struct Samples<'a> {
    capture: &'a Capture<'a>,
    field: LightField,
    images: Vec<&'a Image<u16>>,
    room: Lanes,
    room_linear: VectorLanes,
    depth: Option<&'a Image<f32>>,
    /// Light by way of the object, and how much smaller the image was that it was made from.
    bounced: Option<(&'a BouncedLight, usize)>,
    rotation: Mat3,
    centre: Vec3,
}

impl<'a> Samples<'a> {
    pub(crate) fn new(capture: &'a Capture<'a>, depth: Option<&'a Image<f32>>) -> Result<Self, PhotometricError> {
        let panels = capture.rig.panels();
        if panels.len() > MAX_PANELS {
            return Err(PhotometricError::OutOfRange {
                what: "number of panels",
                value: panels.len() as f64,
                allowed: "3 to 8",
            });
        }
        let image = |channel: u8| {
            let present = || capture.stack.channels().collect();
            capture.stack.light(channel).ok_or_else(|| PhotometricError::NoImage {
                channel,
                present: present(),
            })
        };
        let images = capture
            .rig
            .channels()
            .into_iter()
            .map(image)
            .collect::<Result<_, _>>()?;
        let (mut room, mut room_linear) = (Lanes::ZERO, VectorLanes::default());
        for (lane, panel) in panels.iter().enumerate() {
            room.as_mut_array()[lane] = panel.bounce.constant as f32;
            room_linear.set(lane, to_glam(&panel.bounce.linear));
        }
        let rotation = capture.view.rotation();
        let column = |index: usize| to_glam(&rotation.column(index).into_owned());
        Ok(Self {
            capture,
            field: LightField::new(capture),
            images,
            room,
            room_linear,
            depth,
            bounced: None,
            rotation: Mat3::from_cols(column(0), column(1), column(2)),
            centre: to_glam(&capture.view.centre().coords),
        })
    }

    /// The same with the light that the object throws on itself, from an image so many times smaller.
    pub(crate) fn with_bounced(mut self, light: &'a BouncedLight, scale: usize) -> Self {
        self.bounced = Some((light, scale));
        self
    }

    /// Where a pixel's surface is; base frame, metres.
    pub(crate) fn point(&self, index: usize, depth: f32) -> Vec3 {
        let [right, down] = self.capture.rays.ideal().pixels()[index];
        self.centre + self.rotation * Vec3::new(right, down, 1.0) * depth
    }

    /// What a pixel covers of a surface that faces it, square metres.
    pub(crate) fn pixel_area(&self, depth: f32) -> f32 {
        let [fx, fy] = self.capture.view.camera.focal();
        depth * depth / (fx * fy) as f32
    }

    pub(crate) fn width(&self) -> usize {
        self.capture.stack.width()
    }

    /// Hypotheses for a pixel.
    pub(crate) fn triples(&self, index: usize) -> &[Triple] {
        self.field.triples(index % self.width(), index / self.width())
    }

    /// A pixel, its samples in units of `gain`; none where the lens gives no ray.
    pub(crate) fn pixel(&self, index: usize, gain: f32) -> Option<Pixel> {
        self.pixel_at_scale(index, gain, 1.0)
    }

    /// The same, with all depth times `scale`.
    pub(crate) fn pixel_at_scale(&self, index: usize, gain: f32, scale: f32) -> Option<Pixel> {
        let (x, y) = (index % self.width(), index / self.width());
        let [right, down] = self.capture.rays.ideal().pixels()[index];
        if right.is_nan() {
            return None;
        }
        let ray = self.rotation * Vec3::new(right, down, 1.0);
        let height = self.height(index, ray, scale);
        let mut pixel = Pixel {
            signal: Lanes::ZERO,
            variance: Lanes::ONE,
            valid: Lanes::ZERO,
            lights: self.field.at(x, y, height),
            room: self.room,
            bounced: self.bounced.map_or(Lanes::ZERO, |(light, scale)| light.at(x, y, scale)),
            room_linear: self.room_linear,
            to_camera: -ray.normalize(),
            brightest: 0.0,
        };
        self.read(index, gain, &mut pixel);
        Some(pixel)
    }

    fn height(&self, index: usize, ray: Vec3, scale: f32) -> f32 {
        let depth = self.depth.map_or(f32::NAN, |depth| depth.pixels()[index]);
        if depth.is_nan() {
            USUAL_HEIGHT
        } else {
            (self.centre.z + ray.z * depth * scale).max(-0.02)
        }
    }

    fn read(&self, index: usize, gain: f32, pixel: &mut Pixel) {
        let dark = self.capture.stack.dark().pixels()[index];
        let saturation = self.capture.stack.saturation();
        let (signal, valid) = (pixel.signal.as_mut_array(), pixel.valid.as_mut_array());
        let variance = pixel.variance.as_mut_array();
        for (lane, image) in self.images.iter().enumerate() {
            let raw = image.pixels()[index];
            let of_noise = self.capture.noise.difference_variance(f32::from(raw), f32::from(dark));
            variance[lane] = of_noise / (gain * gain);
            if raw < saturation {
                signal[lane] = (f32::from(raw) - f32::from(dark)) / gain;
                valid[lane] = 1.0;
                pixel.brightest = pixel.brightest.max(signal[lane]);
            }
        }
    }
}
