//! Normals of one image row.

use nalgebra::Vector3;

use crate::least_squares::PixelCounts;
use crate::light_matrix::LightMatrix;

/// What is the same for every row of a capture.
pub(crate) struct RowSolver {
    pub(crate) matrix: LightMatrix,
    pub(crate) pseudo_inverse: Vec<Vector3<f32>>,
    pub(crate) rows: Vec<Vector3<f32>>,
    pub(crate) saturation: u16,
    pub(crate) minimum_signal: f32,
}

/// Where a row's results go.
pub(crate) struct RowOutput<'a> {
    pub(crate) normals: &'a mut [[f32; 3]],
    pub(crate) albedo: &'a mut [f32],
    pub(crate) residual: &'a mut [f32],
}

/// Working space of one thread: one slot per pixel of a row.
#[derive(Default)]
pub(crate) struct RowScratch {
    /// Scaled normal by components, so that the loops over pixels run on plain slices.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Brightest usable sample.
    brightest: Vec<f32>,
    /// Sum of squared samples, and of squared differences to the model.
    energy: Vec<f32>,
    misfit: Vec<f32>,
    /// Largest raw value.
    raw_peak: Vec<u16>,
    samples: Vec<(usize, f32)>,
}

impl RowScratch {
    fn reset(&mut self, width: usize) {
        for slot in [
            &mut self.x,
            &mut self.y,
            &mut self.z,
            &mut self.brightest,
            &mut self.energy,
            &mut self.misfit,
        ] {
            slot.clear();
            slot.resize(width, 0.0);
        }
        self.raw_peak.clear();
        self.raw_peak.resize(width, 0);
    }
}

impl RowSolver {
    /// Solves a row; `lit` holds the same row of every light's image, in the order of the light matrix.
    pub(crate) fn solve(
        &self,
        lit: &[&[u16]],
        dark: &[u16],
        scratch: &mut RowScratch,
        output: &mut RowOutput<'_>,
    ) -> PixelCounts {
        scratch.reset(dark.len());
        for (image, weight) in lit.iter().zip(&self.pseudo_inverse) {
            accumulate(image, dark, *weight, scratch);
        }
        for (image, row) in lit.iter().zip(&self.rows) {
            compare(image, dark, *row, scratch);
        }
        self.finish(lit, dark, scratch, output)
    }

    /// Turns sums into results and solves again, with what is left, where a sample was saturated.
    fn finish(
        &self,
        lit: &[&[u16]],
        dark: &[u16],
        scratch: &mut RowScratch,
        output: &mut RowOutput<'_>,
    ) -> PixelCounts {
        let mut counts = PixelCounts::default();
        for pixel in 0..dark.len() {
            if scratch.raw_peak[pixel] >= self.saturation {
                counts.saturated += 1;
                self.solve_again(lit, dark, pixel, scratch);
            }
            if scratch.brightest[pixel].is_nan() {
                counts.too_few_lights += 1;
            } else if scratch.brightest[pixel] < self.minimum_signal {
                counts.too_dark += 1;
            } else if write_pixel(scratch, pixel, output) {
                counts.solved += 1;
            } else {
                counts.too_dark += 1;
            }
        }
        counts
    }

    /// One pixel without its saturated samples. A pixel that cannot be solved gets NaN as its brightest sample.
    fn solve_again(&self, lit: &[&[u16]], dark: &[u16], pixel: usize, scratch: &mut RowScratch) {
        scratch.samples.clear();
        let usable = lit
            .iter()
            .enumerate()
            .filter(|(_, image)| image[pixel] < self.saturation);
        scratch
            .samples
            .extend(usable.map(|(light, image)| (light, signal(image[pixel], dark[pixel]))));
        scratch.brightest[pixel] = f32::NAN;
        let Some(scaled) = self.matrix.solve_some(&scratch.samples) else {
            return;
        };
        (scratch.x[pixel], scratch.y[pixel], scratch.z[pixel]) = (scaled.x, scaled.y, scaled.z);
        (scratch.energy[pixel], scratch.misfit[pixel]) = (0.0, 0.0);
        scratch.brightest[pixel] = 0.0;
        for &(light, brightness) in &scratch.samples {
            scratch.energy[pixel] += brightness * brightness;
            scratch.misfit[pixel] += (brightness - self.rows[light].dot(&scaled)).powi(2);
            scratch.brightest[pixel] = scratch.brightest[pixel].max(brightness);
        }
    }
}

fn signal(lit: u16, dark: u16) -> f32 {
    f32::from(lit) - f32::from(dark)
}

/// Adds one light's share of the scaled normal, `weight * (lit - dark)`, for a whole row.
fn accumulate(image: &[u16], dark: &[u16], weight: Vector3<f32>, scratch: &mut RowScratch) {
    let sums = scratch.x.iter_mut().zip(&mut scratch.y).zip(&mut scratch.z);
    let extremes = scratch.brightest.iter_mut().zip(&mut scratch.raw_peak);
    for ((((x, y), z), (brightest, raw_peak)), (&lit, &dark)) in sums.zip(extremes).zip(image.iter().zip(dark)) {
        let brightness = signal(lit, dark);
        *x += weight.x * brightness;
        *y += weight.y * brightness;
        *z += weight.z * brightness;
        *brightest = if brightness > *brightest {
            brightness
        } else {
            *brightest
        };
        *raw_peak = (*raw_peak).max(lit);
    }
}

/// Adds one light's squared sample and squared difference to the model, for a whole row.
fn compare(image: &[u16], dark: &[u16], row: Vector3<f32>, scratch: &mut RowScratch) {
    let scaled = scratch.x.iter().zip(&scratch.y).zip(&scratch.z);
    let sums = scratch.energy.iter_mut().zip(&mut scratch.misfit);
    for ((((x, y), z), (energy, misfit)), (&lit, &dark)) in scaled.zip(sums).zip(image.iter().zip(dark)) {
        let brightness = signal(lit, dark);
        let difference = brightness - (row.x * x + row.y * y + row.z * z);
        *energy += brightness * brightness;
        *misfit += difference * difference;
    }
}

/// Splits the scaled normal into direction and length; false when it has none.
fn write_pixel(scratch: &RowScratch, pixel: usize, output: &mut RowOutput<'_>) -> bool {
    let (x, y, z) = (scratch.x[pixel], scratch.y[pixel], scratch.z[pixel]);
    let length = (x * x + y * y + z * z).sqrt();
    if length <= f32::MIN_POSITIVE {
        return false;
    }
    let scale = 1.0 / length;
    output.normals[pixel] = [x * scale, y * scale, z * scale];
    output.albedo[pixel] = length;
    output.residual[pixel] = (scratch.misfit[pixel] / scratch.energy[pixel]).sqrt();
    true
}
