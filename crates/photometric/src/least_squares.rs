//! Photometric stereo by least squares (Woodham 1980, Optical Engineering 19(1), equations 9 and 10 for three lights;
//! here for any number).
//!
//! | symbol | meaning |
//! |---|---|
//! | `b_i` | brightness under light i, dark frame subtracted |
//! | `l_i` | light direction times intensity |
//! | `g = ρ n` | scaled normal: albedo ρ times unit normal n |
//!
//! A Lambertian surface has `b_i = l_i · g` wherever it sees the light, so `g = argmin Σ (b_i - l_i · g)²`. Every
//! unsaturated sample counts, also those in shadow, whose true `b_i` is zero while `l_i · g` may be negative: steep
//! surfaces come out too flat. Telling shadows apart takes more than this method.

use imaging::{ExposureStack, Image};
use rayon::prelude::*;

use crate::directional_light::DirectionalLight;
use crate::error::PhotometricError;
use crate::light_matrix::LightMatrix;
use crate::row_solver::{RowOutput, RowScratch, RowSolver};

/// A normal has three unknowns.
const NEEDED_LIGHTS: usize = 3;

/// What counts as measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastSquaresOptions {
    /// A pixel whose brightest usable sample, dark frame subtracted, stays below this is not solved. In raw digital
    /// numbers, 0 to 65535. The default, 300, is 48 electrons on the rig's cameras (65535 = 10,500 electrons), six
    /// times their read noise of 8.
    pub minimum_signal: f32,
    /// A pixel with fewer unsaturated samples than this is not solved; 3 or more.
    pub minimum_lights: usize,
}

impl Default for LeastSquaresOptions {
    fn default() -> Self {
        Self {
            minimum_signal: 300.0,
            minimum_lights: NEEDED_LIGHTS,
        }
    }
}

/// How many pixels met which fate. `solved + too_dark + too_few_lights` is the size of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PixelCounts {
    /// Pixels with a normal.
    pub solved: usize,
    /// Pixels without: no light brought enough signal.
    pub too_dark: usize,
    /// Pixels without: too many samples were saturated for the rest to determine a normal.
    pub too_few_lights: usize,
    /// Pixels with at least one saturated sample; solved or not.
    pub saturated: usize,
}

impl PixelCounts {
    fn plus(self, other: Self) -> Self {
        Self {
            solved: self.solved + other.solved,
            too_dark: self.too_dark + other.too_dark,
            too_few_lights: self.too_few_lights + other.too_few_lights,
            saturated: self.saturated + other.saturated,
        }
    }
}

/// Normals and what else the images say; all of the stack's size, NaN where there is no measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalMapResult {
    /// Unit normals in the frame of the light directions.
    pub normals: Image<[f32; 3]>,
    /// Length of the scaled normal: reflectance times an unknown scale, digital numbers per unit of light intensity.
    pub albedo: Image<f32>,
    /// Root of the squared misfit over the squared samples, 0 for a perfect fit, 1 when nothing is explained.
    pub residual: Image<f32>,
    /// How many pixels met which fate.
    pub counts: PixelCounts,
}

/// Solves every pixel on its own from all its unsaturated samples; the stack may hold images of more lights than given.
///
/// Rows run in parallel on the caller's rayon pool. Linear in pixels and lights.
pub fn least_squares_normals(
    stack: &ExposureStack,
    lights: &[DirectionalLight],
    options: &LeastSquaresOptions,
) -> Result<NormalMapResult, PhotometricError> {
    let solver = prepare(stack, lights, options)?;
    let lit = lights
        .iter()
        .map(|light| image_of(stack, light))
        .collect::<Result<Vec<_>, _>>()?;
    let (width, height) = (stack.width(), stack.height());
    let mut normals = Image::filled(width, height, [f32::NAN; 3]);
    let mut albedo = Image::filled(width, height, f32::NAN);
    let mut residual = Image::filled(width, height, f32::NAN);
    let outputs = normals
        .pixels_mut()
        .par_chunks_exact_mut(width)
        .zip(albedo.pixels_mut().par_chunks_exact_mut(width))
        .zip(residual.pixels_mut().par_chunks_exact_mut(width));
    let counts = outputs
        .enumerate()
        .map_init(RowScratch::default, |scratch, (y, ((normals, albedo), residual))| {
            let rows: Vec<&[u16]> = lit.iter().map(|image| image.row(y)).collect();
            solver.solve(
                &rows,
                stack.dark().row(y),
                scratch,
                &mut RowOutput {
                    normals,
                    albedo,
                    residual,
                },
            )
        })
        .reduce(PixelCounts::default, PixelCounts::plus);
    Ok(NormalMapResult {
        normals,
        albedo,
        residual,
        counts,
    })
}

fn prepare(
    stack: &ExposureStack,
    lights: &[DirectionalLight],
    options: &LeastSquaresOptions,
) -> Result<RowSolver, PhotometricError> {
    let LeastSquaresOptions {
        minimum_signal,
        minimum_lights,
    } = *options;
    if minimum_lights < NEEDED_LIGHTS {
        let (value, allowed) = (minimum_lights as f64, "3 or more");
        return Err(PhotometricError::OutOfRange {
            what: "minimum_lights",
            value,
            allowed,
        });
    }
    if !(0.0..=65_535.0).contains(&minimum_signal) {
        let (value, allowed) = (f64::from(minimum_signal), "0 to 65535");
        return Err(PhotometricError::OutOfRange {
            what: "minimum_signal",
            value,
            allowed,
        });
    }
    let matrix = LightMatrix::new(lights, minimum_lights)?;
    let pseudo_inverse = matrix.pseudo_inverse();
    let rows = matrix.rows().iter().map(|row| row.cast()).collect();
    Ok(RowSolver {
        matrix,
        pseudo_inverse,
        rows,
        saturation: stack.saturation(),
        minimum_signal,
    })
}

fn image_of<'a>(stack: &'a ExposureStack, light: &DirectionalLight) -> Result<&'a Image<u16>, PhotometricError> {
    let channel = light.channel();
    stack.light(channel).ok_or_else(|| PhotometricError::NoImage {
        channel,
        present: stack.channels().collect(),
    })
}
