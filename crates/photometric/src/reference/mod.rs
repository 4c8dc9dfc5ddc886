//! The published system's own method, kept readable, so that every gain is measured against it on the same images.
//!
//! One vector per light gives a first normal by least squares from the ring lights that are brighter than the overhead
//! one (`I_i > I_7`: what is darker is taken to be in shadow); the overhead light itself is not used. The quadratic light
//! model refines it, and coordinate descent then alternates between normals, drawn towards the mean of their neighbours
//! by a Laplacian term, and one shadow weight per pixel and light. Albedo is free at every pixel.

mod pixel;

use geometry::nalgebra::{Point3, Vector3};
use imaging::{Image, Mask};
use rayon::prelude::*;

use crate::calibration::PolynomialRig;
use crate::error::PhotometricError;
use crate::near_field::Pixels;
use crate::solution::{Capture, NormalSolution};
use pixel::{Lights, PixelState};

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceOptions {
    /// Rounds of coordinate descent.
    pub rounds: usize,
    /// Weight of the Laplacian term against the squared relative misfit of one light.
    pub smoothness: f64,
    /// Height over the table at which the surface is taken to be, metres.
    pub height: f64,
}

impl Default for ReferenceOptions {
    fn default() -> Self {
        Self {
            rounds: 5,
            smoothness: 0.05,
            height: 0.015,
        }
    }
}

/// Normals of a mask's pixels by the published method; the last of the capture's lights is the overhead one.
///
/// # Errors
/// A light without an image; fewer than four lights.
pub fn reference_normals(
    capture: &Capture<'_>,
    mask: &Mask,
    lights: &PolynomialRig,
    options: &ReferenceOptions,
) -> Result<NormalSolution, PhotometricError> {
    if lights.lights.len() < 4 {
        return Err(PhotometricError::TooFewLights {
            got: lights.lights.len(),
            needed: 4,
        });
    }
    let images = images(capture, lights)?;
    let pixels = Pixels::new(mask);
    let start = |&index: &u32| {
        let index = index as usize;
        let dark = f64::from(capture.stack.dark().pixels()[index]);
        let signal = images
            .iter()
            .map(|image| f64::from(image.pixels()[index]) - dark)
            .collect();
        PixelState::start(&at_place(capture, lights, index, options.height), signal)
    };
    let mut states: Vec<PixelState> = pixels.inside.par_iter().map(start).collect();
    for _ in 0..options.rounds {
        states = descend(capture, lights, &pixels, &states, options);
    }
    Ok(output(capture, mask, &pixels, &states))
}

fn images<'a>(capture: &Capture<'a>, lights: &PolynomialRig) -> Result<Vec<&'a Image<u16>>, PhotometricError> {
    let image = |channel: u8| {
        capture.stack.light(channel).ok_or_else(|| PhotometricError::NoImage {
            channel,
            present: capture.stack.channels().collect(),
        })
    };
    lights.lights.iter().map(|light| image(light.channel)).collect()
}

/// The models' coefficients where a pixel's ray meets the plane of the usual height.
fn at_place(capture: &Capture<'_>, lights: &PolynomialRig, index: usize, height: f64) -> Lights {
    let ideal = capture.rays.ideal().pixels()[index];
    let point: Point3<f64> = capture
        .view
        .point_at_depth(ideal, capture.view.depth_of_plane(ideal, height));
    Lights::at(lights, [point.x, point.y])
}

/// One round: every pixel anew from its neighbours' present normals.
fn descend(
    capture: &Capture<'_>,
    lights: &PolynomialRig,
    pixels: &Pixels,
    states: &[PixelState],
    options: &ReferenceOptions,
) -> Vec<PixelState> {
    let anew = |(own, &index): (usize, &u32)| {
        let around = pixels
            .neighbours(index)
            .into_iter()
            .flatten()
            .map(|slot| states[slot].normal);
        let mean = around.filter(|normal| normal.x.is_finite()).sum::<Vector3<f64>>();
        let models = at_place(capture, lights, index as usize, options.height);
        states[own].step(&models, mean.try_normalize(1e-9), options.smoothness)
    };
    pixels.inside.par_iter().enumerate().map(anew).collect()
}

fn output(capture: &Capture<'_>, mask: &Mask, pixels: &Pixels, states: &[PixelState]) -> NormalSolution {
    let (width, height) = (capture.stack.width(), capture.stack.height());
    let mut solution = NormalSolution {
        normals: Image::filled(width, height, [f32::NAN; 3]),
        albedo: Image::filled(width, height, f32::NAN),
        confidence: Image::filled(width, height, 0.0),
        residual: Image::filled(width, height, f32::NAN),
        shadows: Image::filled(width, height, 0),
        lights_used: Image::filled(width, height, 0),
        mask: mask.clone(),
        gain: 1.0,
    };
    for (&index, state) in pixels
        .inside
        .iter()
        .zip(states)
        .filter(|(_, state)| state.normal.x.is_finite())
    {
        let index = index as usize;
        solution.normals.pixels_mut()[index] = state.normal.cast::<f32>().into();
        solution.albedo.pixels_mut()[index] = state.albedo as f32;
        solution.confidence.pixels_mut()[index] = state.confidence() as f32;
        solution.residual.pixels_mut()[index] = state.misfit as f32;
        solution.shadows.pixels_mut()[index] = state.shadows();
        solution.lights_used.pixels_mut()[index] = state.used();
    }
    solution
}
