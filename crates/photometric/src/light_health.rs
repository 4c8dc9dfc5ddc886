//! Whether the panels shine as they should, from the images of any capture.
//!
//! Three figures per panel, each blind to what lies under the lights:
//!
//! - the *signal*, the median over the image of `L_i - D`, tells a dead panel;
//! - its *share* of the sum of all signals, against a reference, tells one that fades;
//! - the *tilt*, the slope over the image of `log((L_i - D) / mean_j (L_j - D))`, tells where the light comes from: the
//!   albedo cancels, and what is left is brighter towards the panel. Two panels whose wires were swapped show each
//!   other's azimuth.

use imaging::{ExposureStack, Image};
use nalgebra::{Matrix3, Vector2, Vector3};

use crate::nominal_rig::{PanelLight, WORKSPACE_CENTRE, nominal_panels};

/// Pixels whose mean over the lights is darker than this many times the noise say nothing about a slope.
const TILT_NOISE_FACTOR: f64 = 6.0;

/// Fewer pixels than this leave a slope undetermined.
const TILT_PIXELS: usize = 100;

/// A panel whose signal is below this many times the noise of a pixel is dark.
const DEAD_NOISE_FACTOR: f64 = 3.0;

/// Every so many rows and columns tell whether a panel shines.
const SAMPLED: usize = 4;

/// How far a tilt may point away from its panel. Whole scenes stay within 6 degrees, a hemisphere that fills the image
/// reaches 40; a neighbour's panel is at 60.
const AZIMUTH_TOLERANCE_DEGREES: f64 = 45.0;

/// An overhead panel's tilt relative to the median of all: 0.05 for whole scenes, 0.35 for a hemisphere that fills the
/// image.
const OVERHEAD_TILT: f64 = 0.5;

/// Panels less than this away from the vertical through the workspace are overhead; they have no azimuth. Metres.
const OVERHEAD_RADIUS: f64 = 0.1;

/// What one capture of one camera says about the lights.
#[derive(Debug, Clone, PartialEq)]
pub struct LightMeasurement {
    /// Median of the dark frame, digital numbers.
    pub ambient: f64,
    /// Standard deviation of a pixel of the dark frame, digital numbers, from neighbours: the scene cancels.
    pub noise: f64,
    /// By ascending channel.
    pub panels: Vec<PanelMeasurement>,
}

/// What the image of one panel shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PanelMeasurement {
    /// The light's number, 1 for L1.
    pub channel: u8,
    /// Median over the image of lit minus dark, digital numbers.
    pub signal: f64,
    /// Slope of the logarithm of this light's part, per image width, to the right and downwards. `None`: too dark.
    pub tilt: Option<Vector2<f64>>,
}

/// When a panel is out of order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightLimits {
    /// Largest deviation of a share from its reference, as a fraction of it.
    pub drift: f64,
    /// A share below this fraction of its reference means that the panel is dead.
    pub dead: f64,
}

impl Default for LightLimits {
    fn default() -> Self {
        Self { drift: 0.2, dead: 0.1 }
    }
}

/// A panel's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PanelHealth {
    /// The light's number, 1 for L1.
    pub channel: u8,
    /// Median over the image of lit minus dark, digital numbers.
    pub signal: f64,
    /// Its share of the light of all panels that live, relative to the reference; `None` without reference.
    pub relative_share: Option<f64>,
    /// From where it shines, degrees in 0..360 around base z; `None` overhead, when too dark or without a pose.
    pub azimuth_degrees: Option<f64>,
    /// What is wrong with it, if anything.
    pub verdict: PanelVerdict,
}

/// What is wrong with a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PanelVerdict {
    /// Nothing.
    Good,
    /// It gives another share of the light than it did.
    Drifted,
    /// It shines from where another panel should be.
    Swapped {
        /// The panel that should be there.
        looks_like: u8,
    },
    /// It gives no light.
    Dead,
}

impl LightMeasurement {
    /// Measures a capture. Every fourth pixel of a large image in both directions is enough.
    pub fn of(stack: &ExposureStack) -> Self {
        let signals: Vec<(u8, Vec<f32>)> = stack
            .channels()
            .map(|channel| (channel, signal(stack, channel)))
            .collect();
        let noise = noise(stack.dark().rows());
        let mean = mean(&signals, stack.width() * stack.height());
        let usable = usable(stack, &mean, noise);
        let panels = signals.iter().map(|(channel, signal)| PanelMeasurement {
            channel: *channel,
            signal: median(signal.iter().copied()),
            tilt: tilt(stack, signal, &mean, &usable),
        });
        Self {
            ambient: median(stack.dark().pixels().iter().map(|&pixel| f32::from(pixel))),
            noise,
            panels: panels.collect(),
        }
    }

    /// Signals, in the order of [`Self::panels`]: a reference for later captures.
    pub fn signals(&self) -> Vec<f64> {
        self.panels.iter().map(|panel| panel.signal).collect()
    }

    /// Judges every panel against a `reference` of as many signals, in whatever unit, and against the rig as drawn,
    /// for which the camera's place has to be known.
    pub fn judge(
        &self,
        reference: Option<&[f64]>,
        base_from_camera: Option<&Matrix3<f64>>,
        limits: LightLimits,
    ) -> Vec<PanelHealth> {
        let reference = reference.filter(|signals| signals.len() == self.panels.len());
        let alive: Vec<bool> = (0..self.panels.len())
            .map(|index| self.is_alive(index, reference, limits))
            .collect();
        let relative = reference.map(|reference| relative_shares(&self.signals(), reference, &alive));
        let usual_tilt = median(
            self.panels
                .iter()
                .filter_map(|panel| panel.tilt)
                .map(|t| t.norm() as f32),
        );
        let judge = |(index, panel): (usize, &PanelMeasurement)| {
            let relative_share = relative.as_ref().map(|shares| shares[index]);
            let tilt = panel.tilt.filter(|_| alive[index]);
            let azimuth = tilt.zip(base_from_camera).map(|(tilt, base)| azimuth(tilt, base));
            let is_level = tilt.is_some_and(|tilt| tilt.norm() < OVERHEAD_TILT * usual_tilt);
            let verdict = match (alive[index], azimuth.and_then(|a| impostor(panel.channel, a, is_level))) {
                (false, _) => PanelVerdict::Dead,
                (true, Some(looks_like)) => PanelVerdict::Swapped { looks_like },
                _ if relative_share.is_some_and(|share| (share - 1.0).abs() > limits.drift) => PanelVerdict::Drifted,
                _ => PanelVerdict::Good,
            };
            PanelHealth {
                channel: panel.channel,
                signal: panel.signal,
                relative_share,
                azimuth_degrees: azimuth.filter(|_| !is_level),
                verdict,
            }
        };
        self.panels.iter().enumerate().map(judge).collect()
    }

    fn is_alive(&self, index: usize, reference: Option<&[f64]>, limits: LightLimits) -> bool {
        let signal = self.panels[index].signal;
        let share = |of: &dyn Fn(usize) -> f64| of(index) / (0..self.panels.len()).map(of).sum::<f64>();
        let shines = signal > DEAD_NOISE_FACTOR * self.noise;
        let fades = reference.is_some_and(|reference| {
            share(&|other| self.panels[other].signal) < limits.dead * share(&|other| reference[other])
        });
        shines && !fades
    }
}

/// Panels that give no light in a capture: their image is as dark as the dark frame, and the others' are not. Looks at
/// every fourth pixel in both directions.
pub fn dark_channels(stack: &ExposureStack) -> Vec<u8> {
    let signal = |channel: u8| {
        let pixels = stack
            .light(channel)
            .into_iter()
            .flat_map(|lit| sampled(lit).zip(sampled(stack.dark())));
        (
            channel,
            median(pixels.map(|(lit, dark)| f32::from(lit) - f32::from(dark))),
        )
    };
    let signals: Vec<(u8, f64)> = stack.channels().map(signal).collect();
    let usual = median(signals.iter().map(|(_, signal)| *signal as f32));
    let darkest = DEAD_NOISE_FACTOR * noise(stack.dark().rows().step_by(SAMPLED));
    let is_dark = |signal: f64| signal <= darkest && usual > 2.0 * darkest;
    let dark = signals.into_iter().filter(|&(_, signal)| is_dark(signal));
    dark.map(|(channel, _)| channel).collect()
}

fn sampled(image: &Image<u16>) -> impl Iterator<Item = u16> {
    image
        .rows()
        .step_by(SAMPLED)
        .flat_map(|row| row.iter().step_by(SAMPLED).copied())
}

fn signal(stack: &ExposureStack, channel: u8) -> Vec<f32> {
    let lit = stack.light(channel).map_or(&[][..], Image::pixels);
    let difference = |(&lit, &dark): (&u16, &u16)| f32::from(lit) - f32::from(dark);
    lit.iter().zip(stack.dark().pixels()).map(difference).collect()
}

fn mean(signals: &[(u8, Vec<f32>)], pixels: usize) -> Vec<f32> {
    let mut mean = vec![0.0; pixels];
    for (_, signal) in signals {
        for (sum, value) in mean.iter_mut().zip(signal) {
            *sum += value / signals.len() as f32;
        }
    }
    mean
}

/// Pixels that are bright enough under the lights and saturated under none.
fn usable(stack: &ExposureStack, mean: &[f32], noise: f64) -> Vec<bool> {
    let least = (TILT_NOISE_FACTOR * noise) as f32;
    let mut usable: Vec<bool> = mean.iter().map(|&mean| mean > least).collect();
    for image in stack.channels().filter_map(|channel| stack.light(channel)) {
        for (usable, &raw) in usable.iter_mut().zip(image.pixels()) {
            *usable &= raw < stack.saturation();
        }
    }
    usable
}

/// From differences of neighbours in a row, which the scene hardly has, by their median absolute value.
fn noise<'a>(dark: impl Iterator<Item = &'a [u16]>) -> f64 {
    const SIGMA_FROM_MEDIAN: f64 = 1.4826;
    // Quantisation to steps of 16 has this standard deviation even where the median of differences is zero.
    const QUANTISATION: f64 = 16.0 / 3.464_101_615;
    let differences = dark.flat_map(|row| row.windows(2).map(|pair| f32::from(pair[0].abs_diff(pair[1]))));
    let sigma = SIGMA_FROM_MEDIAN * median(differences) / std::f64::consts::SQRT_2;
    sigma.max(QUANTISATION)
}

/// The middle value; 0 of none.
fn median(values: impl Iterator<Item = f32>) -> f64 {
    let mut values: Vec<f32> = values.collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    f64::from(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Least-squares plane through the logarithm of a light's part, over (x, y) in image widths from the middle.
fn tilt(stack: &ExposureStack, signal: &[f32], mean: &[f32], usable: &[bool]) -> Option<Vector2<f64>> {
    let (width, height) = (stack.width(), stack.height());
    let (mut matrix, mut right, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0);
    for (index, ((&signal, &mean), _)) in signal
        .iter()
        .zip(mean)
        .zip(usable)
        .enumerate()
        .filter(|(_, (_, u))| **u)
    {
        // A light that gives nothing there still belongs to the slope: it is in shadow or far.
        let part = f64::from((signal / mean).max(1e-3)).ln();
        let x = ((index % width) as f64 - 0.5 * (width - 1) as f64) / width as f64;
        let y = ((index / width) as f64 - 0.5 * (height - 1) as f64) / width as f64;
        let row = Vector3::new(x, y, 1.0);
        matrix += row * row.transpose();
        right += row * part;
        count += 1;
    }
    if count < TILT_PIXELS {
        return None;
    }
    matrix.cholesky().map(|solver| solver.solve(&right).xy())
}

/// Where in the base frame a slope in the image points, degrees in 0..360.
fn azimuth(tilt: Vector2<f64>, base_from_camera: &Matrix3<f64>) -> f64 {
    let in_base = base_from_camera * tilt.push(0.0);
    in_base.y.atan2(in_base.x).to_degrees().rem_euclid(360.0)
}

/// Each signal over its reference, both as shares of those panels that live.
fn relative_shares(signals: &[f64], reference: &[f64], alive: &[bool]) -> Vec<f64> {
    let sum = |values: &[f64]| -> f64 {
        values
            .iter()
            .zip(alive)
            .filter(|(_, alive)| **alive)
            .map(|(v, _)| v)
            .sum()
    };
    let (all, all_before) = (sum(signals), sum(reference));
    let relative = |(signal, before): (&f64, &f64)| (signal / all) / (before / all_before);
    signals.iter().zip(reference).map(relative).collect()
}

/// The panel that should be where this one shines from, unless that is this one.
fn impostor(channel: u8, azimuth: f64, is_level: bool) -> Option<u8> {
    let panels = nominal_panels();
    let own = panels.iter().find(|panel| panel.channel == channel)?;
    let overhead = panels.iter().find(|panel| nominal_azimuth(panel).is_none());
    match nominal_azimuth(own) {
        None if is_level => None,
        Some(_) if is_level => overhead.map(|panel| panel.channel),
        Some(own) if apart(own, azimuth) <= AZIMUTH_TOLERANCE_DEGREES => None,
        _ => nearest(&panels, azimuth),
    }
}

fn nearest(panels: &[PanelLight], azimuth: f64) -> Option<u8> {
    let ring = panels
        .iter()
        .filter_map(|panel| Some((panel.channel, nominal_azimuth(panel)?)));
    let found = ring.min_by(|(_, a), (_, b)| apart(*a, azimuth).total_cmp(&apart(*b, azimuth)));
    found.map(|(channel, _)| channel)
}

fn nominal_azimuth(panel: &PanelLight) -> Option<f64> {
    let offset = (panel.centre - WORKSPACE_CENTRE).xy();
    (offset.norm() > OVERHEAD_RADIUS).then(|| offset.y.atan2(offset.x).to_degrees().rem_euclid(360.0))
}

/// Between two azimuths, degrees in 0..=180.
fn apart(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(360.0);
    difference.min(360.0 - difference)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 48;
    /// Metres from the middle of the image to its border.
    const HALF_VIEW: f64 = 0.11;

    /// A camera that looks straight down, its x axis along base y.
    fn base_from_camera() -> Matrix3<f64> {
        Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    }

    /// A printed level mat under the rig as drawn; panel `i` is driven by `gains[i]` and wired to `wires[i]`.
    fn capture(gains: [f64; 7], wires: [usize; 7], ambient: u16) -> ExposureStack {
        let mut random = 1_u32;
        let mut noise = move || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random >> 16) / 65_536.0 * 60.0 - 30.0
        };
        let panels = nominal_panels();
        let albedo = |x: usize, y: usize| if (x / 5 + y / 7).is_multiple_of(2) { 0.3 } else { 0.9 };
        let mut image = |light: Option<(&PanelLight, f64)>| {
            let mut pixels = Vec::new();
            for (y, x) in (0..SIDE * SIDE).map(|i| (i / SIDE, i % SIDE)) {
                let metres = |pixel: usize| (pixel as f64 / (SIDE - 1) as f64 - 0.5) * 2.0 * HALF_VIEW;
                let in_base = base_from_camera() * Vector3::new(metres(x), metres(y), 0.0);
                let point = WORKSPACE_CENTRE + in_base;
                let lit = light.map_or(0.0, |(panel, gain)| {
                    let light = panel.directional_light(point.into()).unwrap();
                    gain * light.direction().z * light.intensity() * 8_000.0
                });
                pixels.push((f64::from(ambient) + albedo(x, y) * lit + noise()).max(0.0) as u16);
            }
            Image::new(SIDE, SIDE, pixels).unwrap()
        };
        let mut images = vec![(0, image(None))];
        for index in 0..7 {
            images.push((index as u8 + 1, image(Some((&panels[wires[index]], gains[index])))));
        }
        ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, 65_520).unwrap()
    }

    const AS_DRAWN: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];

    fn verdicts(stack: &ExposureStack, reference: Option<&[f64]>) -> Vec<PanelVerdict> {
        let health = LightMeasurement::of(stack).judge(reference, Some(&base_from_camera()), LightLimits::default());
        health.iter().map(|panel| panel.verdict).collect()
    }

    fn good() -> Vec<PanelVerdict> {
        vec![PanelVerdict::Good; 7]
    }

    #[test]
    fn panels_shine_from_where_they_were_drawn() {
        let measured = LightMeasurement::of(&capture([1.0; 7], AS_DRAWN, 200));
        assert!((measured.ambient - 200.0).abs() < 5.0, "{measured:?}");
        assert!(measured.noise > 10.0 && measured.noise < 30.0, "{measured:?}");
        let health = measured.judge(None, Some(&base_from_camera()), LightLimits::default());
        for (panel, expected) in health.iter().zip([30.0, 90.0, 150.0, 210.0, 270.0, 330.0]) {
            assert!(apart(panel.azimuth_degrees.unwrap(), expected) < 5.0, "{panel:?}");
        }
        assert_eq!(health[6].azimuth_degrees, None, "overhead");
        assert_eq!(health.iter().map(|panel| panel.verdict).collect::<Vec<_>>(), good());
    }

    #[test]
    fn a_dead_panel_is_named_and_the_others_keep_their_shares() {
        let reference = LightMeasurement::of(&capture([1.0; 7], AS_DRAWN, 200)).signals();
        let stack = capture([1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0], AS_DRAWN, 200);
        let mut expected = good();
        expected[2] = PanelVerdict::Dead;
        assert_eq!(verdicts(&stack, Some(&reference)), expected);
        assert_eq!(verdicts(&stack, None), expected, "the noise alone tells it too");
        assert_eq!(dark_channels(&stack), [3]);
        assert_eq!(dark_channels(&capture([1.0; 7], AS_DRAWN, 200)), [0; 0]);
        assert_eq!(
            dark_channels(&capture([0.0; 7], AS_DRAWN, 200)),
            [0; 0],
            "nothing can be told"
        );
        // Stray light keeps it over the noise, but not over a tenth of what it was.
        let stray = capture([1.0, 1.0, 0.07, 1.0, 1.0, 1.0, 1.0], AS_DRAWN, 200);
        assert_eq!(verdicts(&stray, Some(&reference))[2], PanelVerdict::Dead);
    }

    #[test]
    fn drift_is_of_one_panel_and_not_of_the_exposure() {
        let reference = LightMeasurement::of(&capture([1.0; 7], AS_DRAWN, 200)).signals();
        assert_eq!(verdicts(&capture([0.5; 7], AS_DRAWN, 200), Some(&reference)), good());
        let stack = capture([1.0, 1.0, 1.0, 1.0, 0.7, 1.0, 1.0], AS_DRAWN, 200);
        let mut expected = good();
        expected[4] = PanelVerdict::Drifted;
        assert_eq!(verdicts(&stack, Some(&reference)), expected);
        assert_eq!(
            verdicts(&stack, Some(&[1.0; 3])),
            good(),
            "a reference of another rig is none"
        );
    }

    #[test]
    fn swapped_wires_show_the_other_panel() {
        let looks_like = |looks_like| PanelVerdict::Swapped { looks_like };
        let mut expected = good();
        (expected[0], expected[1]) = (looks_like(2), looks_like(1));
        assert_eq!(verdicts(&capture([1.0; 7], [1, 0, 2, 3, 4, 5, 6], 200), None), expected);
        let mut expected = good();
        (expected[3], expected[6]) = (looks_like(7), looks_like(4));
        assert_eq!(verdicts(&capture([1.0; 7], [0, 1, 2, 6, 4, 5, 3], 200), None), expected);
    }

    #[test]
    fn without_the_cameras_place_nothing_is_said_about_directions() {
        let measured = LightMeasurement::of(&capture([1.0; 7], [1, 0, 2, 3, 4, 5, 6], 200));
        let health = measured.judge(None, None, LightLimits::default());
        assert!(
            health
                .iter()
                .all(|panel| panel.azimuth_degrees.is_none() && panel.verdict == PanelVerdict::Good)
        );
    }

    #[test]
    fn a_black_scene_has_dead_panels_and_no_slopes() {
        let stack = capture([0.0; 7], AS_DRAWN, 200);
        let measured = LightMeasurement::of(&stack);
        assert!(measured.panels.iter().all(|panel| panel.tilt.is_none()), "{measured:?}");
        assert_eq!(verdicts(&stack, None), vec![PanelVerdict::Dead; 7]);
    }
}
