//! Photographs as measurements.

use crate::error::ImagingError;
use crate::image::Image;

/// Undoes a display gamma (2.2 for most photographs) and averages the three colours into one linear 16-bit value.
///
/// A pixel with any colour at 255 has lost light nobody measured; it becomes 65535, and no other pixel does, so a
/// saturation limit of 65535 finds exactly the clipped ones.
pub fn gamma_to_linear_mono16(picture: &Image<[u8; 3]>, gamma: f64) -> Result<Image<u16>, ImagingError> {
    const CLIPPED: u16 = u16::MAX;
    if !(0.1..=10.0).contains(&gamma) {
        return Err(ImagingError::OutOfRange {
            what: "gamma",
            value: gamma,
            allowed: "0.1 to 10",
        });
    }
    let linear: Vec<f64> = (0..=255_u8).map(|code| (f64::from(code) / 255.0).powf(gamma)).collect();
    let scale = f64::from(CLIPPED - 1) / 3.0;
    Ok(picture.map(|rgb| {
        if rgb.contains(&255) {
            return CLIPPED;
        }
        let sum: f64 = rgb.iter().map(|&code| linear[usize::from(code)]).sum();
        (sum * scale).round() as u16
    }))
}
