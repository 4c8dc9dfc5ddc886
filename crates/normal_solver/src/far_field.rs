//! Solving with lights far away.

use std::time::Duration;

use geometry::RigidTransform;
use photometric::{LeastSquaresOptions, NormalMapResult, PixelCounts, least_squares_normals};

use crate::assembler::Capture;
use crate::convert;
use crate::error::Error;
use crate::lights::lights_in_base;
use crate::parameters::Parameters;

pub(crate) fn solve(
    capture: &Capture,
    parameters: &Parameters,
    base_from_lights: &RigidTransform,
) -> Result<NormalMapResult, Error> {
    let lights = lights_in_base(
        &parameters.light_directions.get(),
        &parameters.light_intensities.get(),
        base_from_lights,
    )?;
    // The parameter's range is that of a u16.
    let stack = convert::exposure_stack(capture, &lights, parameters.saturation.get() as u16)?;
    let minimum_signal = parameters.minimum_signal.get() as f32;
    let options = LeastSquaresOptions {
        minimum_signal,
        ..LeastSquaresOptions::default()
    };
    Ok(least_squares_normals(&stack, &lights, &options)?)
}

pub(crate) fn report(camera: &str, capture_id: &str, images: usize, counts: PixelCounts, took: Duration) {
    let PixelCounts {
        solved,
        too_dark,
        too_few_lights,
        saturated,
    } = counts;
    let took_ms = took.as_millis();
    tracing::info!(
        camera,
        capture_id,
        images,
        solved,
        too_dark,
        too_few_lights,
        saturated,
        took_ms,
        "solved"
    );
}
