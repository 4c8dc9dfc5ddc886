//! Depth as a picture that people can read.

use imaging::Image;

/// Width of a pixel on the table, metres: what the rig's cameras see.
const PIXEL: f32 = 0.25e-3;

/// Depth (metres) as if lit from the top left: what turns towards it is bright; black where there is none.
pub(crate) fn relief(depth: &Image<f32>) -> Image<u8> {
    let at = |x: usize, y: usize| depth.get(x, y).copied().unwrap_or(f32::NAN);
    Image::from_fn(depth.width(), depth.height(), |x, y| {
        let here = at(x, y);
        let (across, down) = (at(x + 1, y) - here, at(x, y + 1) - here);
        // Depth falls towards the light.
        let slope = -(across + down) / PIXEL;
        let lit = (0.6 - slope * 0.3) / (1.0 + slope * slope).sqrt();
        (lit * 255.0).clamp(0.0, 255.0) as u8
    })
}
