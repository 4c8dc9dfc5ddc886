//! How well the lights explain a capture as a whole.

use crate::solution::NormalSolution;

/// From this mean confidence on a capture is explained. Path-traced objects, from pyramid to cow, have 0.84 to 0.96;
/// with two of their lights exchanged, or the camera 100 mm off, most fall to 0.6 to 0.82.
const LEAST_CONFIDENCE: f32 = 0.83;
/// Up to this median misfit, sigmas. The same objects have 0.4 to 0.65, and with exchanged lights mostly 0.9 to 1.5.
const LARGEST_RESIDUAL: f32 = 0.85;
/// Pixels that fewer lights reach fit by construction.
const TELLING_LIGHTS: u8 = 4;

/// How well the lights explain a capture as a whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Pixels with a normal.
    pub normals: usize,
    /// Those that fewer than three lights reach: their normals lean on their neighbours.
    pub few_lights: usize,
    /// Mean confidence of the pixels with a normal, 0 to 1; 0 without one.
    pub confidence: f32,
    /// Median misfit of the pixels that four lights or more reach, in sigmas of noise; NaN without one.
    pub residual: f32,
}

impl NormalSolution {
    /// Sums up the pixels.
    pub fn quality(&self) -> Quality {
        let known = || {
            let numbers = self.confidence.pixels().iter().zip(self.residual.pixels());
            let numbers = numbers.zip(self.lights_used.pixels());
            let pixels = self.normals.pixels().iter().zip(numbers);
            pixels
                .filter(|(normal, _)| normal[0].is_finite())
                .map(|(_, numbers)| numbers)
        };
        let normals = known().count();
        let confidence: f64 = known().map(|((confidence, _), _)| f64::from(*confidence)).sum();
        let told = known().filter(|(_, used)| **used >= TELLING_LIGHTS);
        let mut residuals: Vec<f32> = told.map(|((_, residual), _)| *residual).collect();
        residuals.sort_by(f32::total_cmp);
        Quality {
            normals,
            few_lights: known().filter(|(_, used)| **used < 3).count(),
            confidence: (confidence / normals.max(1) as f64) as f32,
            residual: residuals.get(residuals.len() / 2).copied().unwrap_or(f32::NAN),
        }
    }
}

impl Quality {
    /// Why the result should not be trusted as it is; none when nothing speaks against it. Deep folds raise doubt as
    /// wrong lights do, and a single plane explains exchanged lights by another slope: no doubt is no proof.
    pub fn doubt(&self) -> Option<String> {
        if self.normals == 0 {
            return Some("no pixel has a normal: nothing but mat, or no light".to_owned());
        }
        let fits = self.residual.is_nan() || self.residual <= LARGEST_RESIDUAL;
        let is_fine = self.confidence >= LEAST_CONFIDENCE && fits;
        (!is_fine).then(|| {
            format!(
                "the lights explain the images badly (mean confidence {:.2}, usual are {LEAST_CONFIDENCE} and more; median misfit {:.2} sigmas, usual are up to {LARGEST_RESIDUAL}): lights exchanged or moved, a camera that is not where it is said to be, deep folds, or a surface far from matte",
                self.confidence, self.residual
            )
        })
    }
}
