//! Angles to the truth, summed up.

use std::fmt;

use imaging::{Image, Mask};
use rig_scenes::Truth;
use serde::Serialize;

/// Angle of a pixel without a normal, degrees.
const MISSING: f64 = 90.0;

/// Angles over the object's pixels, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Score {
    pub(super) mean: f64,
    pub(super) std: f64,
    pub(super) median: f64,
    pub(super) p95: f64,
    /// Share of the pixels below 20 degrees, per cent.
    pub(super) below_20: f64,
    /// Share of the pixels that have a normal, per cent.
    pub(super) coverage: f64,
}

impl Score {
    /// A pixel without a normal counts as 90 degrees.
    pub(super) fn of(normals: &Image<[f32; 3]>, truth: &Truth, mask: &Mask) -> Self {
        let pairs = normals.pixels().iter().zip(truth.normals.pixels());
        let inside = pairs.zip(mask.as_image().pixels()).filter(|(_, inside)| **inside != 0);
        let mut angles: Vec<f64> = inside
            .map(|((found, truth), _)| angle(*found, *truth).unwrap_or(MISSING))
            .collect();
        angles.sort_by(f64::total_cmp);
        let count = angles.len().max(1) as f64;
        let at = |share: f64| angles.get((share * count) as usize).copied().unwrap_or(MISSING);
        let mean = angles.iter().sum::<f64>() / count;
        let variance = angles.iter().map(|angle| (angle - mean).powi(2)).sum::<f64>() / count;
        let share = |is: fn(&f64) -> bool| 100.0 * angles.iter().filter(|angle| is(angle)).count() as f64 / count;
        Self {
            mean,
            std: variance.sqrt(),
            median: at(0.5),
            p95: at(0.95),
            below_20: share(|angle| *angle < 20.0),
            coverage: share(|angle| *angle < MISSING),
        }
    }
}

/// Degrees between unit vectors; none when one is missing.
fn angle(found: [f32; 3], truth: [f32; 3]) -> Option<f64> {
    let dot: f64 = found.iter().zip(truth).map(|(a, b)| f64::from(a * b)).sum();
    (!dot.is_nan()).then(|| dot.clamp(-1.0, 1.0).acos().to_degrees())
}

/// Angles pixel by pixel, degrees: NaN where one is missing, 0 off the object.
pub(super) fn angles(normals: &Image<[f32; 3]>, truth: &Truth, mask: &Mask) -> Image<f32> {
    Image::from_fn(normals.width(), normals.height(), |x, y| {
        if !mask.contains(x, y) {
            return 0.0;
        }
        let at = y * normals.width() + x;
        angle(normals.pixels()[at], truth.normals.pixels()[at]).map_or(f32::NAN, |angle| angle as f32)
    })
}

impl fmt::Display for Score {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "mean {:5.2} ({:5.2})  median {:5.2}  p95 {:5.1}  below 20 degrees {:5.1} %  coverage {:5.1} %",
            self.mean, self.std, self.median, self.p95, self.below_20, self.coverage
        )
    }
}
