//! What sizes are allowed, and what a mesh must be to be seen.

use std::ops::RangeInclusive;

use crate::SimError;

/// Metres: thinner is nothing, larger is no object for this table.
const SIZES: RangeInclusive<f64> = 1e-4..=1.0;

pub(super) fn size(place: &str, value: f64) -> Result<(), SimError> {
    if SIZES.contains(&value) {
        return Ok(());
    }
    let allowed = format!("{} to {} m", SIZES.start(), SIZES.end());
    Err(SimError::value(place, format!("{value} m"), allowed))
}

pub(super) fn sizes(place: &str, values: &[f64]) -> Result<(), SimError> {
    values.iter().try_for_each(|value| size(place, *value))
}

pub(super) fn count(place: &str, value: u32, allowed: RangeInclusive<u32>) -> Result<(), SimError> {
    if allowed.contains(&value) {
        return Ok(());
    }
    let allowed = format!("{} to {}", allowed.start(), allowed.end());
    Err(SimError::value(place, value.to_string(), allowed))
}
