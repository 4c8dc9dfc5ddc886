//! Differences added up.

use serde::Serialize;

/// Relative errors are counted in steps of this, up to 200 %.
const STEP_PERCENT: f64 = 0.05;
const STEPS: usize = 4000;

/// Where a pixel belongs, for one light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    /// Object; the light reaches it directly.
    DirectLit,
    /// Object; the light reaches it over others only.
    Shadowed,
    /// Mat and table.
    Room,
}

/// Sums over the pixels of one group.
#[derive(Debug, Clone)]
pub(super) struct Sums {
    pixels: f64,
    truth: f64,
    difference: f64,
    squared: f64,
    /// What the capture's own noise makes of the squared difference.
    noise: f64,
    /// How many pixels have which relative error.
    relative: Vec<u32>,
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            pixels: 0.0,
            truth: 0.0,
            difference: 0.0,
            squared: 0.0,
            noise: 0.0,
            relative: vec![0; STEPS],
        }
    }
}

/// How far a group of pixels is from the truth. Percentages are of the group's own mean signal.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Score {
    pub(super) pixels: f64,
    pub(super) mean_signal: f64,
    /// Root of the mean squared difference.
    pub(super) rms_percent: f64,
    /// Mean difference, ours minus truth.
    pub(super) bias_percent: f64,
    /// Half of the pixels differ by less, each in percent of its own signal.
    pub(super) median_percent: f64,
    /// Root mean square of the noise that the capture itself contains.
    pub(super) noise_percent: f64,
}

impl Sums {
    pub(super) fn add(&mut self, ours: f64, truth: f64, noise_variance: f64) {
        let difference = ours - truth;
        self.pixels += 1.0;
        self.truth += truth;
        self.difference += difference;
        self.squared += difference * difference;
        self.noise += noise_variance;
        let percent = 100.0 * difference.abs() / truth.max(1.0);
        self.relative[((percent / STEP_PERCENT) as usize).min(STEPS - 1)] += 1;
    }

    /// Adds another image's pixels, each image in units of its own mean signal: exposures differ.
    pub(super) fn add_image(&mut self, image: &Self) {
        if image.pixels == 0.0 {
            return;
        }
        let unit = image.pixels / image.truth;
        self.pixels += image.pixels;
        self.truth += image.truth * unit;
        self.difference += image.difference * unit;
        self.squared += image.squared * unit * unit;
        self.noise += image.noise * unit * unit;
        for (sum, count) in self.relative.iter_mut().zip(&image.relative) {
            *sum += count;
        }
    }

    /// None without pixels.
    pub(super) fn score(&self) -> Option<Score> {
        if self.pixels == 0.0 {
            return None;
        }
        let mean = self.truth / self.pixels;
        let percent = |value: f64| 100.0 * value / mean;
        Some(Score {
            pixels: self.pixels,
            mean_signal: mean,
            rms_percent: percent((self.squared / self.pixels).sqrt()),
            bias_percent: percent(self.difference / self.pixels),
            median_percent: self.median(),
            noise_percent: percent((self.noise / self.pixels).sqrt()),
        })
    }

    fn median(&self) -> f64 {
        let mut below = 0.0;
        let step = self.relative.iter().position(|&count| {
            below += f64::from(count);
            below >= self.pixels / 2.0
        });
        (step.unwrap_or(STEPS) as f64 + 0.5) * STEP_PERCENT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_share_too_bright_is_all_there_is_to_tell() {
        let mut sums = Sums::default();
        for truth in [1000.0, 2000.0, 3000.0] {
            sums.add(truth + 40.0, truth, 100.0);
        }
        let score = sums.score().unwrap();
        assert!((score.rms_percent - 2.0).abs() < 1e-9 && (score.bias_percent - 2.0).abs() < 1e-9);
        assert!((score.noise_percent - 0.5).abs() < 1e-9);
        assert!((score.median_percent - 2.0).abs() < 0.1, "{score:?}");
    }

    #[test]
    fn a_brighter_exposure_of_the_same_counts_the_same() {
        let mut all = Sums::default();
        for exposure in [1.0, 10.0] {
            let mut image = Sums::default();
            image.add(1030.0 * exposure, 1000.0 * exposure, 0.0);
            image.add(970.0 * exposure, 1000.0 * exposure, 0.0);
            all.add_image(&image);
        }
        let score = all.score().unwrap();
        assert!(
            (score.rms_percent - 3.0).abs() < 1e-9 && score.bias_percent.abs() < 1e-9,
            "{score:?}"
        );
    }

    #[test]
    fn nothing_seen_has_no_score() {
        assert!(Sums::default().score().is_none());
    }
}
