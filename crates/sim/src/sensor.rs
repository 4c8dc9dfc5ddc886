//! From radiance to digital numbers.
//!
//! With radiance `L` of the ambient light and of panel `i`, the share `s_i` of the exposure during which it was lit, and
//! the exposure time `t`, a pixel collects, in electrons (`G` is the sensor's gain, `F` its full well):
//!
//! ```text
//! mean      e = c t (L_ambient + sum_i s_i L_i)                  c = dn_per_radiance_second F / 65535
//! noise     n ~ N(0, (e + read_noise^2) / averaged)              shot noise and read noise
//! output    16 clamp(round((min(e + n, F) G 65535 / F + black_level) / 16), 0, 4095)
//! ```

use imaging::Image;

use crate::SimError;
use crate::render::RenderedView;
use noise::{CHUNK, Noise};

pub(crate) use noise::mix;

mod noise;

/// Steps of the output: twelve bits in sixteen.
const STEP: f32 = 16.0;
/// Largest code of the converter.
const MOST: f32 = 4095.0;
/// Digital numbers at full well, without gain and black level.
const FULL_SCALE: f64 = 65535.0;

/// The properties of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Standard deviation of reading a pixel out, electrons.
    pub read_noise: f64,
    /// Electrons at which a pixel saturates.
    pub full_well: f64,
    /// Digital numbers (65535 at full well) that one unit of radiance gives in a second, without gain.
    pub dn_per_radiance_second: f64,
}

/// Brightest object pixel, of albedo 0.85, at 80 % of full scale after 2.5 ms.
impl Default for Sensor {
    fn default() -> Self {
        Self {
            read_noise: 8.0,
            full_well: 10_500.0,
            dn_per_radiance_second: 7.35e8,
        }
    }
}

/// How an image is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// How long light is collected.
    pub seconds: f64,
    /// Amplification before quantisation.
    pub gain_decibels: f64,
    /// Digital numbers to add.
    pub black_level: u32,
    /// Pixels of the sensor averaged into one, which lowers the noise.
    pub averaged: u32,
    /// The part of the view that is read out.
    pub region: Region,
}

/// A part of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Region {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Which panels were lit for how much of an exposure, in units of 1/1024 of it. [`Default`] is dark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct LightState([u16; 7]);

impl LightState {
    /// 1 in [`LightState`]'s unit.
    const WHOLE: f64 = 1024.0;

    /// Shares of the exposure, 0..=1, for L1 to L7.
    pub fn from_shares(shares: [f64; 7]) -> Self {
        Self(shares.map(|share| (share * Self::WHOLE).round() as u16))
    }

    /// One panel, 1 to 7, during the whole exposure; dark for any other number.
    pub fn single(panel: u8) -> Self {
        Self(std::array::from_fn(|index| {
            if index + 1 == usize::from(panel) { 1024 } else { 0 }
        }))
    }

    /// Shares of the exposure, 0..=1.
    pub fn shares(self) -> [f64; 7] {
        self.0.map(|share| f64::from(share) / Self::WHOLE)
    }
}

/// Factors of a readout, worked out once per image.
struct Factors {
    electrons_per_radiance: f32,
    inverse_averaged: f32,
    read_variance: f32,
    full_well: f32,
    codes_per_electron: f32,
    black: f32,
}

impl Sensor {
    /// The image of an exposure. `noise` names its noise: the same number gives the same image.
    pub fn expose(
        &self,
        view: &RenderedView,
        lights: LightState,
        exposure: &Exposure,
        noise: u64,
    ) -> Result<Image<u16>, SimError> {
        let Region { x, y, width, height } = exposure.region;
        let (columns, rows) = (view.ambient.width(), view.ambient.height());
        let fits = |start: usize, length: usize, limit| start.checked_add(length).is_some_and(|end| end <= limit);
        if width == 0 || height == 0 || !fits(x, width, columns) || !fits(y, height, rows) {
            let (found, allowed) = (format!("{:?}", exposure.region), format!("inside {columns} x {rows}"));
            return Err(SimError::value("region", found, allowed));
        }
        let factors = self.factors(exposure);
        let lit = LitPanels::new(view, lights, &factors);
        let mut noise = Noise::new(noise);
        let mut pixels = vec![0; width * height];
        let (mut electrons, mut deviations) = ([0.0; CHUNK], [0.0; CHUNK]);
        for (row, target) in pixels.chunks_exact_mut(width).enumerate() {
            let start = (y + row) * columns + x;
            for (index, chunk) in target.chunks_mut(CHUNK).enumerate() {
                lit.collect(start + index * CHUNK, &mut electrons[..chunk.len()]);
                noise.next_chunk(&mut deviations);
                factors.read_out(&electrons, &deviations, chunk);
            }
        }
        Ok(Image::new(width, height, pixels)?)
    }

    fn factors(&self, exposure: &Exposure) -> Factors {
        let averaged = f64::from(exposure.averaged.max(1));
        let gain = 10_f64.powf(exposure.gain_decibels / 20.0);
        let dn_per_electron = FULL_SCALE / self.full_well;
        Factors {
            electrons_per_radiance: (self.dn_per_radiance_second * exposure.seconds / dn_per_electron) as f32,
            inverse_averaged: (1.0 / averaged) as f32,
            read_variance: (self.read_noise * self.read_noise / averaged) as f32,
            full_well: self.full_well as f32,
            codes_per_electron: (dn_per_electron * gain) as f32 / STEP,
            black: exposure.black_level as f32 / STEP,
        }
    }
}

/// Images that shine during an exposure, with their factors to electrons.
struct LitPanels<'a> {
    ambient: (&'a [f32], f32),
    panels: Vec<(&'a [f32], f32)>,
}

impl<'a> LitPanels<'a> {
    fn new(view: &'a RenderedView, lights: LightState, factors: &Factors) -> Self {
        let shares = lights.shares().map(|share| share as f32);
        let lit = shares.iter().zip(&view.lights).filter(|(share, _)| **share > 0.0);
        let lit = lit.map(|(share, image)| (image.pixels(), share * factors.electrons_per_radiance));
        Self {
            ambient: (view.ambient.pixels(), factors.electrons_per_radiance),
            panels: lit.collect(),
        }
    }

    /// Of as many pixels from `start` on as there is room for.
    fn collect(&self, start: usize, electrons: &mut [f32]) {
        let end = start + electrons.len();
        let (ambient, factor) = self.ambient;
        for (sum, radiance) in electrons.iter_mut().zip(&ambient[start..end]) {
            *sum = radiance * factor;
        }
        for (pixels, factor) in &self.panels {
            for (sum, radiance) in electrons.iter_mut().zip(&pixels[start..end]) {
                *sum += radiance * factor;
            }
        }
    }
}

impl Factors {
    /// Free of branches, so that it is done for several pixels at once.
    fn read_out(&self, electrons: &[f32; CHUNK], noise: &[f32; CHUNK], target: &mut [u16]) {
        /// Adding it rounds a small number and leaves it in the lowest bits.
        const ROUND: f32 = 8_388_608.0;
        for ((target, mean), noise) in target.iter_mut().zip(electrons).zip(noise) {
            let deviation = (mean * self.inverse_averaged + self.read_variance).sqrt();
            let collected = (mean + noise * deviation).min(self.full_well);
            let code = (collected * self.codes_per_electron + self.black).clamp(0.0, MOST);
            *target = ((code + ROUND).to_bits() as u16) << 4;
        }
    }
}

#[cfg(test)]
mod tests;
