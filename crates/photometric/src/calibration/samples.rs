//! Points of the target with their normals and what each light gave them.

use geometry::nalgebra::{Point3, Vector3};

use super::target::hit;
use super::{CalibrationOptions, PlacementReport, TargetView};
use crate::error::PhotometricError;
use crate::light_rig::LightRig;

/// Samples of a view, about.
const PER_VIEW: usize = 250;
/// Closer to the silhouette pixels mix with the mat: cosine between normal and line of sight.
const LEAST_FACING: f64 = 0.3;
/// Closer to the mat its bounce is not the room's, metres.
const LEAST_HEIGHT: f64 = 0.004;
/// Part of the signal that no model explains.
const MODEL_SHARE: f64 = 0.01;

/// One pixel of the target.
#[derive(Debug, Clone)]
pub(super) struct TargetSample {
    /// Position of the view.
    pub(super) view: usize,
    /// Base frame, metres.
    pub(super) point: Point3<f64>,
    /// Unit, base frame.
    pub(super) normal: Vector3<f64>,
    /// Dark-subtracted digital numbers and their standard deviation, light by light; none where saturated.
    pub(super) signal: Vec<Option<(f64, f64)>>,
}

/// Samples of all views whose target was found.
pub(super) fn collect(
    views: &[TargetView<'_>],
    placements: &[PlacementReport],
    rig: &LightRig,
    options: &CalibrationOptions,
) -> Result<Vec<TargetSample>, PhotometricError> {
    let mut samples = Vec::new();
    for (position, view) in views.iter().enumerate() {
        let found = placements
            .iter()
            .find(|placement| placement.placement == view.placement);
        let Some([x, y]) = found.and_then(|placement| placement.centre) else {
            continue;
        };
        samples.extend(of_view(position, view, &Point3::new(x, y, 0.0), rig, options)?);
    }
    Ok(samples)
}

fn of_view(
    position: usize,
    view: &TargetView<'_>,
    centre: &Point3<f64>,
    rig: &LightRig,
    options: &CalibrationOptions,
) -> Result<Vec<TargetSample>, PhotometricError> {
    let images = rig.channels().into_iter().map(|channel| {
        view.stack.light(channel).ok_or_else(|| PhotometricError::NoImage {
            channel,
            present: view.stack.channels().collect(),
        })
    });
    let images = images.collect::<Result<Vec<_>, _>>()?;
    let camera = view.view.centre();
    let usable = |index: usize| {
        let (point, normal) = hit(view, index, centre, options.radius)?;
        let facing = normal.dot(&(camera - point).normalize());
        (facing > LEAST_FACING && point.z > LEAST_HEIGHT).then_some((index, point, normal))
    };
    let inside: Vec<_> = (0..view.stack.dark().pixels().len()).filter_map(usable).collect();
    // A stride that shares no factor with the width spreads the samples over the target.
    let stride = inside.len().div_ceil(PER_VIEW).max(1) | 1;
    let sample = |&(index, point, normal): &(usize, Point3<f64>, Vector3<f64>)| {
        let dark = view.stack.dark().pixels()[index];
        let of_light = |raw: u16| {
            let signal = f64::from(raw) - f64::from(dark);
            let variance = f64::from(options.noise.difference_variance(f32::from(raw), f32::from(dark)));
            let sigma = (variance + (MODEL_SHARE * signal).powi(2)).sqrt();
            (raw < view.stack.saturation()).then_some((signal, sigma))
        };
        let signal = images.iter().map(|image| of_light(image.pixels()[index])).collect();
        TargetSample {
            view: position,
            point,
            normal,
            signal,
        }
    };
    Ok(inside.iter().step_by(stride).map(sample).collect())
}
