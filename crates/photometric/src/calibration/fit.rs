//! Levenberg and Marquardt's method per light, the views' gains in between.

use geometry::nalgebra::{SMatrix, Vector3};
use rayon::prelude::*;

use super::panel_parameters::{COUNT, SCALES, Step, moved};
use super::polynomial::{PolynomialLight, PolynomialRig};
use super::samples::TargetSample;
use super::{LightReport, median};
use crate::light_rig::{LightRig, PanelModel};

/// Rounds of gains and lights; the misfit stands still after half of them.
const ROUNDS: usize = 30;
/// Inverse of the prior's standard deviation: panels are aimed within some 20 degrees, and hang within 0.1 m.
const AIM_PRIOR: f64 = 1.0 / 0.35;
const PLACE_PRIOR: f64 = 1.0 / 0.1;

/// A rig and the gains that fit.
pub(super) struct Fitted {
    pub(super) rig: LightRig,
    gains: Vec<f64>,
}

type Matrix = SMatrix<f64, COUNT, COUNT>;

pub(super) fn fit(samples: &[TargetSample], start: LightRig) -> Fitted {
    let views = samples.iter().map(|sample| sample.view + 1).max().unwrap_or(0);
    let drawn: Vec<PanelModel> = start.panels().to_vec();
    let mut panels = drawn.clone();
    let mut damping = vec![1e-2; panels.len()];
    let mut gains = fit_gains(samples, &panels, views);
    for _ in 0..ROUNDS {
        let stepped: Vec<(PanelModel, f64)> = (0..panels.len())
            .into_par_iter()
            .map(|light| improve(samples, &gains, light, &panels[light], &drawn[light], damping[light]))
            .collect();
        for (light, (panel, next)) in stepped.into_iter().enumerate() {
            panels[light] = panel;
            damping[light] = next;
        }
        gains = fit_gains(samples, &panels, views);
    }
    let mean = panels.iter().map(|panel| panel.radiance).sum::<f64>() / panels.len() as f64;
    for panel in &mut panels {
        panel.radiance /= mean;
        panel.bounce.constant /= mean;
        panel.bounce.linear /= mean;
    }
    for gain in &mut gains {
        *gain *= mean;
    }
    // Steps keep every number finite and the radiance positive, so the rig is valid.
    let rig = LightRig::new(panels).unwrap_or(start);
    Fitted { rig, gains }
}

/// What a light's model misses of a sample, sigmas.
fn misfit(sample: &TargetSample, light: usize, panel: &PanelModel, gain: f64) -> Option<f64> {
    let (signal, sigma) = sample.signal[light]?;
    Some((signal - gain * panel.irradiance(&sample.point, &sample.normal)) / sigma)
}

/// Weight of the soft L1 norm.
fn weight(misfit: f64) -> f64 {
    1.0 / (1.0 + misfit * misfit).sqrt()
}

fn cost(misfit: f64) -> f64 {
    2.0 * ((1.0 + misfit * misfit).sqrt() - 1.0)
}

fn fit_gains(samples: &[TargetSample], panels: &[PanelModel], views: usize) -> Vec<f64> {
    let of_view = |view: usize| {
        let own: Vec<&TargetSample> = samples.iter().filter(|sample| sample.view == view).collect();
        let pairs: Vec<(f64, f64, f64)> = own
            .iter()
            .flat_map(|sample| {
                panels.iter().enumerate().filter_map(|(light, panel)| {
                    let (signal, sigma) = sample.signal[light]?;
                    Some((signal, panel.irradiance(&sample.point, &sample.normal), sigma))
                })
            })
            .collect();
        robust_ratio(&pairs)
    };
    (0..views).into_par_iter().map(of_view).collect()
}

/// The factor between signals and irradiances, by re-weighted least squares.
fn robust_ratio(pairs: &[(f64, f64, f64)]) -> f64 {
    let mut gain: Option<f64> = None;
    for _ in 0..5 {
        let (mut above, mut below) = (0.0, 0.0);
        for &(signal, irradiance, sigma) in pairs {
            let w = gain.map_or(1.0, |gain| weight((signal - gain * irradiance) / sigma)) / (sigma * sigma);
            above += w * signal * irradiance;
            below += w * irradiance * irradiance;
        }
        gain = (below > 0.0).then(|| above / below);
    }
    gain.unwrap_or(1.0)
}

/// One accepted step of a light, or none and more damping.
fn improve(
    samples: &[TargetSample],
    gains: &[f64],
    light: usize,
    panel: &PanelModel,
    drawn: &PanelModel,
    damping: f64,
) -> (PanelModel, f64) {
    let (matrix, right, before) = normal_equations(samples, gains, light, panel, drawn);
    let mut damping = damping;
    for _ in 0..6 {
        let mut damped = matrix;
        for i in 0..COUNT {
            damped[(i, i)] += damping * (matrix[(i, i)] + 1.0);
        }
        let Some(factor) = damped.cholesky() else { break };
        let step = factor.solve(&right).component_mul(&Step::from(SCALES));
        let trial = moved(panel, &step);
        if total_cost(samples, gains, light, &trial, drawn) < before {
            return (trial, damping / 5.0);
        }
        damping *= 5.0;
    }
    (*panel, damping)
}

fn total_cost(samples: &[TargetSample], gains: &[f64], light: usize, panel: &PanelModel, drawn: &PanelModel) -> f64 {
    let sum: f64 = samples
        .iter()
        .filter_map(|sample| misfit(sample, light, panel, gains[sample.view]))
        .map(cost)
        .sum();
    sum + prior(panel, drawn).norm_squared()
}

/// How far a panel is from the drawing, in standard deviations.
fn prior(panel: &PanelModel, drawn: &PanelModel) -> geometry::nalgebra::SVector<f64, 6> {
    let aim: Vector3<f64> = (panel.rectangle.facing.into_inner() - drawn.rectangle.facing.into_inner()) * AIM_PRIOR;
    let place: Vector3<f64> = (panel.rectangle.centre - drawn.rectangle.centre) * PLACE_PRIOR;
    geometry::nalgebra::SVector::from([aim.x, aim.y, aim.z, place.x, place.y, place.z])
}

/// Derivatives are numeric: the closed form is cheap and has corners at the horizon anyway.
fn normal_equations(
    samples: &[TargetSample],
    gains: &[f64],
    light: usize,
    panel: &PanelModel,
    drawn: &PanelModel,
) -> (Matrix, Step, f64) {
    let tried: Vec<PanelModel> = (0..COUNT)
        .map(|i| {
            let mut step = Step::zeros();
            step[i] = 1e-3 * SCALES[i];
            moved(panel, &step)
        })
        .collect();
    let (mut matrix, mut right, mut total) = (Matrix::zeros(), Step::zeros(), 0.0);
    for sample in samples {
        let gain = gains[sample.view];
        let Some(here) = misfit(sample, light, panel, gain) else {
            continue;
        };
        let slope = |i: usize| misfit(sample, light, &tried[i], gain).map_or(0.0, |there| (here - there) / 1e-3);
        let row = Step::from_fn(|i, _| slope(i));
        let w = weight(here);
        matrix += row * row.transpose() * w;
        right += row * (w * here);
        total += cost(here);
    }
    let here = prior(panel, drawn);
    let slopes: Vec<_> = tried.iter().map(|panel| (prior(panel, drawn) - here) / 1e-3).collect();
    for i in 0..COUNT {
        right[i] -= slopes[i].dot(&here);
        for j in 0..COUNT {
            matrix[(i, j)] += slopes[i].dot(&slopes[j]);
        }
    }
    (matrix, right, total + here.norm_squared())
}

impl Fitted {
    /// Median over the lights of a sample's misfit.
    pub(super) fn median_sigmas(&self, sample: &TargetSample) -> f64 {
        let gain = self.gains[sample.view];
        let panels = self.rig.panels().iter().enumerate();
        let misfits = panels.filter_map(|(light, panel)| misfit(sample, light, panel, gain).map(f64::abs));
        median(misfits.collect()).unwrap_or(f64::INFINITY)
    }

    /// The published models, fitted to the same samples with the same gains.
    pub(super) fn polynomials(&self, samples: &[TargetSample]) -> PolynomialRig {
        let fit = |(light, panel): (usize, &PanelModel)| {
            let of_light = |sample: &TargetSample| {
                let (signal, _) = sample.signal[light]?;
                let place = [sample.point.x, sample.point.y];
                Some((place, sample.normal, signal / self.gains[sample.view]))
            };
            let own: Vec<_> = samples.iter().filter_map(of_light).collect();
            PolynomialLight::fit(panel.channel, &own)
        };
        let panels: Vec<_> = self.rig.panels().iter().enumerate().collect();
        PolynomialRig {
            lights: panels.into_par_iter().map(fit).collect(),
        }
    }

    pub(super) fn light_reports(&self, samples: &[TargetSample]) -> Vec<LightReport> {
        let report = |(light, panel): (usize, &PanelModel)| {
            let (mut misfits, mut squares, mut signals) = (Vec::new(), 0.0, 0.0);
            for sample in samples {
                let gain = self.gains[sample.view];
                let Some(off) = misfit(sample, light, panel, gain) else {
                    continue;
                };
                misfits.push(off.abs());
                if let Some((signal, sigma)) = sample.signal[light] {
                    squares += (off * sigma / gain).powi(2);
                    signals += signal / gain;
                }
            }
            let count = misfits.len();
            LightReport {
                channel: panel.channel,
                samples: count,
                median_sigmas: median(misfits).unwrap_or(f64::INFINITY),
                rms_share: (squares / count.max(1) as f64).sqrt() / (signals / count.max(1) as f64),
            }
        };
        self.rig.panels().iter().enumerate().map(report).collect()
    }
}
