//! Normals of surfaces that are not matte, under many distant lights.
//!
//! Each pixel by itself, after Shi, Tan, Matsushita and Ikeuchi, "Bi-polynomial modeling of low-frequency reflectances"
//! (TPAMI 2014): the brightest samples, which a highlight may have touched, and the darkest, which a shadow may have,
//! are left out; what remains is a low-frequency reflectance, a polynomial of second order in the cosines of the half
//! and of the difference angle:
//!
//! ```text
//! I = n·l Σ_ij C_ij (n·h)^i (l·h)^j,   i, j = 0, 1, 2,   h = (l + v) / |l + v|
//! ```
//!
//! Normal and coefficients are found in turn. Few lights cannot tell such a reflectance from a normal: for the panels of
//! the cell there is [`near_field_normals`](crate::near_field_normals).

mod pixel;

use geometry::nalgebra::{Unit, Vector3};
use imaging::{Image, Mask};
use rayon::prelude::*;

use crate::error::PhotometricError;
use pixel::Geometry;

/// Images under many lights.
#[derive(Debug, Clone, Copy)]
pub struct ManyLightInput<'a> {
    /// One for each light: linear, dark-subtracted, divided by the light's intensity; any unit. NaN for a sample that
    /// does not count.
    pub samples: &'a [Image<f32>],
    /// From the surface to each light, in a frame of the caller's.
    pub directions: &'a [Unit<Vector3<f64>>],
    /// From the surface to the camera, same frame; the camera is far away.
    pub to_camera: Unit<Vector3<f64>>,
    /// Pixels to solve.
    pub mask: &'a Mask,
}

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManyLightOptions {
    /// Share of the samples that are left out as too dark: shadows, attached and cast.
    pub darkest: f64,
    /// Share of the samples up to which they count; brighter ones may be highlights.
    pub brightest: f64,
    /// Rounds of coefficients and normal.
    pub rounds: usize,
}

impl Default for ManyLightOptions {
    fn default() -> Self {
        Self {
            darkest: 0.3,
            brightest: 0.8,
            rounds: 12,
        }
    }
}

/// Fewer lights leave nothing when the brightest and darkest are gone.
const LEAST_LIGHTS: usize = 16;

/// Unit normals in the frame of the directions; NaN outside the mask and where too few samples count.
///
/// # Errors
/// Fewer than 16 lights; numbers of images and directions that differ; images of other sizes; shares that are not
/// 0 <= darkest < brightest <= 1.
pub fn many_light_normals(
    input: &ManyLightInput<'_>,
    options: &ManyLightOptions,
) -> Result<Image<[f32; 3]>, PhotometricError> {
    check(input, options)?;
    let geometry = Geometry::new(input.directions, input.to_camera);
    let mask = input.mask.as_image();
    let solve = |index: usize| {
        if mask.pixels()[index] == 0 {
            return [f32::NAN; 3];
        }
        let samples: Vec<f64> = input
            .samples
            .iter()
            .map(|image| f64::from(image.pixels()[index]))
            .collect();
        geometry
            .solve(&samples, options)
            .map_or([f32::NAN; 3], |normal| normal.cast::<f32>().into())
    };
    let solved: Vec<[f32; 3]> = (0..mask.pixels().len())
        .into_par_iter()
        .with_min_len(64)
        .map(solve)
        .collect();
    let mut normals = Image::filled(mask.width(), mask.height(), [f32::NAN; 3]);
    normals.pixels_mut().copy_from_slice(&solved);
    Ok(normals)
}

fn check(input: &ManyLightInput<'_>, options: &ManyLightOptions) -> Result<(), PhotometricError> {
    let got = input.directions.len().min(input.samples.len());
    if got < LEAST_LIGHTS {
        return Err(PhotometricError::TooFewLights {
            got,
            needed: LEAST_LIGHTS,
        });
    }
    if input.directions.len() != input.samples.len() {
        return Err(PhotometricError::OutOfRange {
            what: "number of images minus number of directions",
            value: input.samples.len() as f64 - input.directions.len() as f64,
            allowed: "0",
        });
    }
    if !(options.darkest >= 0.0 && options.darkest < options.brightest && options.brightest <= 1.0) {
        return Err(PhotometricError::OutOfRange {
            what: "share of the darkest samples",
            value: options.darkest,
            allowed: "from 0 to less than the share of the brightest, which is at most 1",
        });
    }
    let mask = input.mask.as_image();
    let other = input
        .samples
        .iter()
        .find(|image| (image.width(), image.height()) != (mask.width(), mask.height()));
    other.map_or(Ok(()), |image| {
        Err(PhotometricError::OtherSize {
            what: "the images",
            width: image.width(),
            height: image.height(),
            expected_width: mask.width(),
            expected_height: mask.height(),
        })
    })
}
