//! Where the panels are and how bright, from captures of a matte white hemisphere that stands on the mat.
//!
//! Every view has a gain of its own (its exposure is not known), so that only the ratios between the lights of a view,
//! and how they change over the target, carry information. Aim and radiance of a panel trade against each other: judge
//! a calibration by the irradiance it predicts, not by the panels' geometry.

mod fit;
mod panel_parameters;
mod polynomial;
mod samples;
mod target;

use rayon::prelude::*;

use crate::error::PhotometricError;
use crate::light_rig::LightRig;
use crate::object_mask::ObjectMaskOptions;
use crate::sensor_noise::SensorNoise;
use crate::view::{PixelRays, View};
use imaging::ExposureStack;

pub use polynomial::{PolynomialLight, PolynomialRig};

use samples::TargetSample;

/// One camera's capture of the target at one place.
#[derive(Debug, Clone, Copy)]
pub struct TargetView<'a> {
    /// Where the target stood, in words; views of one placement share it.
    pub placement: &'a str,
    /// Which camera.
    pub camera: &'a str,
    /// Dark and lit images.
    pub stack: &'a ExposureStack,
    /// From where.
    pub view: &'a View,
    /// Of that view's camera.
    pub rays: &'a PixelRays,
}

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationOptions {
    /// Radius of the hemisphere, metres.
    pub radius: f64,
    /// Of the cameras.
    pub noise: SensorNoise,
}

/// A rig fitted to captures, and how well it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct LightCalibration {
    /// Mean radiance 1.
    pub rig: LightRig,
    /// The published system's models of the same lights, for comparison.
    pub polynomials: PolynomialRig,
    /// One for each placement, in the order of their first views.
    pub placements: Vec<PlacementReport>,
    /// One for each light.
    pub lights: Vec<LightReport>,
    /// None when the calibration may be used.
    pub failure: Option<String>,
}

/// How well a placement fits.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacementReport {
    /// As given.
    pub placement: String,
    /// Where the target's centre was found, base frame, metres; none when it was not found.
    pub centre: Option<[f64; 2]>,
    /// Median misfit in sigmas; none when the target was not found.
    pub median_sigmas: Option<f64>,
    /// Why the placement was left out; none when it was used.
    pub dropped: Option<String>,
}

/// How well a light fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightReport {
    /// The light's channel.
    pub channel: u8,
    /// Samples that were used.
    pub samples: usize,
    /// Median of the misfit's size, in sigmas of noise.
    pub median_sigmas: f64,
    /// Root mean square misfit over the mean signal, of samples that the light reaches.
    pub rms_share: f64,
}

impl CalibrationOptions {
    /// The rig's target and cameras: radius 40 mm.
    pub const RIG: Self = Self {
        radius: 0.04,
        noise: SensorNoise::RIG,
    };
}

impl LightCalibration {
    /// How many placements that were used stand in each part of the mat: `parts` along x and along y; those beyond its
    /// border count in the nearest.
    pub fn coverage(&self, mat: &ObjectMaskOptions, parts: [usize; 2]) -> Vec<Vec<usize>> {
        let mut counts = vec![vec![0; parts[1]]; parts[0]];
        let part = |centre: [f64; 2], axis: usize| {
            let along = (centre[axis] - mat.mat_centre[axis]) / mat.mat_size[axis] + 0.5;
            ((along * parts[axis] as f64).max(0.0) as usize).min(parts[axis] - 1)
        };
        let used = self.placements.iter().filter(|placement| placement.dropped.is_none());
        if parts.iter().all(|&count| count > 0) {
            for centre in used.filter_map(|placement| placement.centre) {
                counts[part(centre, 0)][part(centre, 1)] += 1;
            }
        }
        counts
    }
}

/// Fewer placements leave the panels' distance open.
const LEAST_PLACEMENTS: usize = 6;
/// A placement this many times worse than the median placement has a wrong pose or something before the target.
const WORSE: f64 = 3.0;
/// A light that fits worse than this share of its signal is not to be used.
const LARGEST_RMS_SHARE: f64 = 0.08;

/// Fits a rig to views of the target, starting from the rig as drawn.
///
/// A bad placement is left out and named; too few good ones, or a light that does not fit, make a calibration that
/// failed and says why.
///
/// # Errors
/// An image of some light is missing; rays of another size than their camera; fewer placements than six.
pub fn calibrate_lights(
    views: &[TargetView<'_>],
    options: &CalibrationOptions,
) -> Result<LightCalibration, PhotometricError> {
    let start = LightRig::nominal();
    let mut placements = target::locate(views, options)?;
    let found = placements.iter().filter(|placement| placement.centre.is_some()).count();
    if found < LEAST_PLACEMENTS {
        return Err(PhotometricError::OutOfRange {
            what: "placements of the target that were found",
            value: found as f64,
            allowed: "at least 6",
        });
    }
    let samples = samples::collect(views, &placements, &start, options)?;
    let mut fitted = fit::fit(&samples, start);
    judge(&mut placements, views, &fitted, &samples);
    if placements
        .iter()
        .any(|placement| placement.dropped.is_some() && placement.centre.is_some())
    {
        let kept: Vec<TargetSample> = samples
            .into_iter()
            .filter(|sample| placement_of(&placements, views, sample).dropped.is_none())
            .collect();
        fitted = fit::fit(&kept, fitted.rig.clone());
        return Ok(finish(fitted, &kept, placements));
    }
    Ok(finish(fitted, &samples, placements))
}

fn placement_of<'a>(
    placements: &'a [PlacementReport],
    views: &[TargetView<'_>],
    sample: &TargetSample,
) -> &'a PlacementReport {
    let name = views[sample.view].placement;
    placements
        .iter()
        .find(|placement| placement.placement == name)
        .unwrap_or(&placements[0])
}

/// Says of each placement how well it fits and drops those that are far worse than the rest.
fn judge(placements: &mut [PlacementReport], views: &[TargetView<'_>], fitted: &fit::Fitted, samples: &[TargetSample]) {
    let median_of = |name: &str| {
        let own: Vec<f64> = samples
            .par_iter()
            .filter(|sample| views[sample.view].placement == name)
            .map(|sample| fitted.median_sigmas(sample))
            .collect();
        median(own)
    };
    for placement in placements.iter_mut().filter(|placement| placement.centre.is_some()) {
        placement.median_sigmas = median_of(&placement.placement);
    }
    let usual = median(
        placements
            .iter()
            .filter_map(|placement| placement.median_sigmas)
            .collect(),
    )
    .unwrap_or(1.0);
    let limit = WORSE * usual.max(1.0);
    for placement in placements.iter_mut() {
        if let Some(sigmas) = placement.median_sigmas.filter(|sigmas| *sigmas > limit) {
            placement.dropped = Some(format!(
                "its median misfit is {sigmas:.1} sigmas, usual are {usual:.1}: a wrong camera pose, or something before the target"
            ));
        }
    }
}

fn finish(fitted: fit::Fitted, samples: &[TargetSample], placements: Vec<PlacementReport>) -> LightCalibration {
    let lights = fitted.light_reports(samples);
    let used = placements
        .iter()
        .filter(|placement| placement.dropped.is_none())
        .count();
    let bad = lights.iter().find(|light| light.rms_share > LARGEST_RMS_SHARE);
    let failure = match bad {
        _ if used < LEAST_PLACEMENTS => Some(format!(
            "{used} placements can be used, at least {LEAST_PLACEMENTS} are needed"
        )),
        Some(light) => Some(format!(
            "light {} misses its samples by {:.1} % RMS, allowed are {:.0} %",
            light.channel,
            100.0 * light.rms_share,
            100.0 * LARGEST_RMS_SHARE
        )),
        None => None,
    };
    LightCalibration {
        polynomials: fitted.polynomials(samples),
        rig: fitted.rig,
        placements,
        lights,
        failure,
    }
}

pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
