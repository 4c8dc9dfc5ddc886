//! Angles to the truth, summed up.

use std::fmt;

use imaging::{Image, Mask};
use photometric::DepthMap;
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
        let mut angles: Vec<f64> = inside.map(|((found, truth), _)| angle(*found, *truth)).collect();
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

fn angle(found: [f32; 3], truth: [f32; 3]) -> f64 {
    let dot: f64 = found.iter().zip(truth).map(|(a, b)| f64::from(a * b)).sum();
    if dot.is_nan() {
        MISSING
    } else {
        dot.clamp(-1.0, 1.0).acos().to_degrees()
    }
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

/// Depth over the object's pixels, millimetres, after one offset is taken off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct DepthScore {
    pub(super) mean: f64,
    pub(super) max: f64,
    /// The offset: the median difference.
    pub(super) offset: f64,
    /// Share of the pixels that have a depth, per cent.
    pub(super) coverage: f64,
}

impl DepthScore {
    /// None when no pixel has a depth.
    pub(super) fn of(found: &DepthMap, truth: &Truth, mask: &Mask) -> Option<Self> {
        let pairs = found.depth.pixels().iter().zip(truth.depth.pixels());
        let inside = pairs.zip(mask.as_image().pixels()).filter(|(_, inside)| **inside != 0);
        let mut off: Vec<f64> = inside
            .map(|((found, truth), _)| 1e3 * f64::from(found - truth))
            .filter(|off| off.is_finite())
            .collect();
        off.sort_by(f64::total_cmp);
        let offset = *off.get(off.len() / 2)?;
        let count = off.len() as f64;
        let errors = off.iter().map(|off| (off - offset).abs());
        Some(Self {
            mean: errors.clone().sum::<f64>() / count,
            max: errors.fold(0.0, f64::max),
            offset,
            coverage: 100.0 * count / mask.count().max(1) as f64,
        })
    }
}

impl fmt::Display for DepthScore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.3} mm (max {:.2}, offset {:+.2})",
            self.mean, self.max, self.offset
        )
    }
}
