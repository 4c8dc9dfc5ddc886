//! Gaussian noise faster than an image can be read.
//!
//! Each run of [`CHUNK`] pixels is the sum of two stretches of one table, at places and with signs that a hash of the
//! image's number and the run's position chooses: sums of normal variables are normal, and the pairs are many enough
//! that no image shows a pattern.

use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Pixels in a run.
pub(super) const CHUNK: usize = 256;
const PLACES: usize = 1 << 16;

static TABLE: LazyLock<Vec<f32>> = LazyLock::new(table);

/// The noise of one image, run after run.
pub(super) struct Noise {
    state: u64,
    table: &'static [f32],
}

impl Noise {
    pub(super) fn new(image: u64) -> Self {
        Self {
            state: mix(image),
            table: &TABLE,
        }
    }

    /// Of mean 0 and variance 1.
    pub(super) fn next_chunk(&mut self, deviations: &mut [f32; CHUNK]) {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let dice = mix(self.state);
        let stretch = |dice: u64| {
            let place = dice as usize % PLACES;
            let sign = if dice & 1 << 16 == 0 { 1.0 } else { -1.0 };
            (
                &self.table[place..place + CHUNK],
                sign * std::f32::consts::FRAC_1_SQRT_2,
            )
        };
        let ((first, a), (second, b)) = (stretch(dice), stretch(dice >> 32));
        for ((sum, first), second) in deviations.iter_mut().zip(first).zip(second) {
            *sum = first * a + second * b;
        }
    }
}

/// Normal variables (Box and Muller 1958), brought to mean 0 and variance 1 exactly.
fn table() -> Vec<f32> {
    let mut random = fastrand::Rng::with_seed(0x5ea5_0000);
    let mut values: Vec<f64> = (0..PLACES)
        .map(|_| (-2.0 * (1.0 - random.f64()).ln()).sqrt() * (TAU * random.f64()).cos())
        .collect();
    let mean = values.iter().sum::<f64>() / PLACES as f64;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / PLACES as f64;
    for value in &mut values {
        *value = (*value - mean) / variance.sqrt();
    }
    // Stretches that begin near the end go on at the beginning.
    values.extend_from_within(..CHUNK);
    values.into_iter().map(|value| value as f32).collect()
}

/// Spreads a number over 64 bits (the finaliser of `SplitMix64`; Steele, Lea and Flood 2014).
pub(crate) fn mix(number: u64) -> u64 {
    let number = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ (number >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ (number >> 31)
}
