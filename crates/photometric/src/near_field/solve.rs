//! The solver as a whole.

use imaging::{Image, Mask};

use super::bounced::BouncedLight;
use super::coupling::couple;
use super::fit::{Known, fit_all};
use super::gain;
use super::height::best_scale;
use super::pixel::Estimate;
use super::pixels::Pixels;
use super::samples::Samples;
use crate::error::PhotometricError;
use crate::solution::{Capture, NormalSolution};

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearFieldOptions {
    /// How firmly neighbours hold together, as an inverse variance of their difference: 1 over 2 degrees squared. 0
    /// leaves every pixel to itself.
    pub coupling: f32,
    /// What the usual surface reflects of the light, 0 to 1: how much its parts light each other.
    pub reflectance: f32,
}

impl Default for NearFieldOptions {
    fn default() -> Self {
        Self {
            coupling: 800.0,
            reflectance: 0.85,
        }
    }
}

impl NearFieldOptions {
    fn check(self) -> Result<(), PhotometricError> {
        let (coupling, reflectance) = (f64::from(self.coupling), f64::from(self.reflectance));
        PhotometricError::require_within("coupling", coupling, 0.0..=1e9, "0 to 1e9 per square radian")?;
        PhotometricError::require_within("reflectance", reflectance, 0.0..=1.0, "0 to 1")
    }
}

/// Normals of a mask's pixels, as the solver keeps them.
pub(crate) struct Solved {
    pixels: Pixels,
    estimates: Vec<Estimate>,
    gain: f32,
}

/// What an image of half the size says.
pub(crate) struct FirstLook {
    solved: Solved,
    bounced: Option<BouncedLight>,
}

/// Normals of the pixels of a mask, under panels near the work. `depth` (metres along the optical axis) says where the
/// surface is, if it is known.
///
/// # Errors
/// A panel without an image, a mask or depth of another size, more panels than the solver takes, options out of range.
pub fn near_field_normals(
    capture: &Capture<'_>,
    mask: &Mask,
    depth: Option<&Image<f32>>,
    options: NearFieldOptions,
) -> Result<NormalSolution, PhotometricError> {
    Ok(solve(capture, mask, depth, None, options)?.solution(capture, mask))
}

/// The same, started from an image of half the size if there is one.
pub(crate) fn solve(
    capture: &Capture<'_>,
    mask: &Mask,
    depth: Option<&Image<f32>>,
    coarse: Option<&FirstLook>,
    options: NearFieldOptions,
) -> Result<Solved, PhotometricError> {
    options.check()?;
    require_size(capture, "the mask", mask.as_image())?;
    if let Some(depth) = depth {
        require_size(capture, "the depth", depth)?;
    }
    let mut samples = Samples::new(capture, depth)?;
    if let Some(light) = coarse.and_then(|coarse| coarse.bounced.as_ref()) {
        samples = samples.with_bounced(light, 2);
    }
    let pixels = Pixels::new(mask);
    let Some(gain) = gain::estimate(&samples, &pixels.inside) else {
        let estimates = vec![Estimate::UNKNOWN; pixels.inside.len()];
        return Ok(Solved {
            pixels,
            estimates,
            gain: 0.0,
        });
    };
    let coarse = coarse.map(|coarse| &coarse.solved);
    let coarse = coarse.filter(|coarse| coarse.gain > 0.0).map(|coarse| Known {
        pixels: &coarse.pixels,
        estimates: &coarse.estimates,
    });
    let mut estimates = fit_all(&samples, &pixels, gain, coarse.as_ref());
    if options.coupling > 0.0 {
        let normals = couple(&estimates, &pixels, options.coupling);
        for (estimate, normal) in estimates.iter_mut().zip(normals) {
            estimate.normal = normal;
        }
    }
    Ok(Solved {
        pixels,
        estimates,
        gain: gain.value,
    })
}

fn require_size<T>(capture: &Capture<'_>, what: &'static str, image: &Image<T>) -> Result<(), PhotometricError> {
    let (expected_width, expected_height) = (capture.stack.width(), capture.stack.height());
    let (width, height) = (image.width(), image.height());
    if (width, height) == (expected_width, expected_height) {
        return Ok(());
    }
    Err(PhotometricError::OtherSize {
        what,
        width,
        height,
        expected_width,
        expected_height,
    })
}

impl Solved {
    /// As the first look at a capture of twice the size; `depth` is of this size.
    pub(crate) fn first_look(
        self,
        capture: &Capture<'_>,
        depth: &Image<f32>,
        options: NearFieldOptions,
    ) -> Result<FirstLook, PhotometricError> {
        require_size(capture, "the depth", depth)?;
        let samples = Samples::new(capture, Some(depth))?;
        let bounced = (self.gain > 0.0 && options.reflectance > 0.0).then(|| {
            let (pixels, estimates) = (&self.pixels, &self.estimates);
            BouncedLight::new(&samples, pixels, estimates, depth, self.gain, options.reflectance)
        });
        Ok(FirstLook { solved: self, bounced })
    }

    /// The factor of a depth map, from some, under which the samples fit best.
    pub(crate) fn best_scale(
        &self,
        capture: &Capture<'_>,
        depth: &Image<f32>,
        scales: &[f32],
    ) -> Result<Option<f32>, PhotometricError> {
        require_size(capture, "the depth", depth)?;
        let samples = Samples::new(capture, Some(depth))?;
        let (inside, estimates) = (&self.pixels.inside, &self.estimates);
        Ok(best_scale(&samples, inside, estimates, self.gain, scales))
    }

    /// As images.
    pub(crate) fn solution(&self, capture: &Capture<'_>, mask: &Mask) -> NormalSolution {
        let ((normals, albedo), ((confidence, residual), (shadows, lights_used))) = rayon::join(
            || {
                let normals = self.image(capture, [f32::NAN; 3], |estimate| estimate.normal.to_array());
                (normals, self.image(capture, f32::NAN, |estimate| estimate.albedo))
            },
            || {
                let confidence = self.image(capture, 0.0, Estimate::confidence);
                let residual = self.image(capture, f32::NAN, Estimate::residual);
                let shadows = self.image(capture, 0, |estimate| estimate.shadows);
                (
                    (confidence, residual),
                    (shadows, self.image(capture, 0, |estimate| estimate.used)),
                )
            },
        );
        NormalSolution {
            normals,
            albedo,
            confidence,
            residual,
            shadows,
            lights_used,
            mask: mask.clone(),
            gain: f64::from(self.gain),
        }
    }

    /// One thing of all pixels that have a normal, and `beyond` elsewhere.
    fn image<T: Copy>(&self, capture: &Capture<'_>, beyond: T, of: impl Fn(&Estimate) -> T) -> Image<T> {
        let mut image = Image::filled(capture.stack.width(), capture.stack.height(), beyond);
        let pixels = image.pixels_mut();
        for (&index, estimate) in self.pixels.inside.iter().zip(&self.estimates) {
            if estimate.normal.is_finite() {
                pixels[index as usize] = of(estimate);
            }
        }
        image
    }
}
