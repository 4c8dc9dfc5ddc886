//! Adaptive mean shift: a window moves to the middle of what it holds and takes its size and shape.
//!
//! Bradski, "Computer vision face tracking for use in a perceptual user interface", Intel Technology Journal Q2 1998:
//! the window goes to its centroid (zeroth and first moments), then takes the scale of what it holds, and second moments
//! give the orientation. There the scale is a multiple of the root of the mass; here it is the box around the ellipse of
//! second moments, which keeps long facets together as well, and lets the window grow to all that hangs together.

use crate::moments::{Moments, Spread};

/// The window is this much larger than the ellipse of what it holds.
const MARGIN: f64 = 1.25;
const STEPS: usize = 25;
/// Cells; the window has come to rest when it moves and grows less.
const REST: f64 = 0.1;

/// Half sizes of the box around the ellipse of a spread.
pub(crate) fn window_around(spread: &Spread, least: f64) -> [f64; 2] {
    let half = |variance: f64| (MARGIN * 2.0 * variance.sqrt()).max(least);
    [half(spread.variance[0]), half(spread.variance[2])]
}

/// From a start to rest; none where the window finds nothing.
pub(crate) fn mode(moments: &Moments, start: [f64; 2], least_half: f64) -> Option<Spread> {
    let (mut middle, mut half) = (start, [least_half; 2]);
    let mut found = None;
    for _ in 0..STEPS {
        let spread = Spread::of(&moments.sums(&moments.bounds(middle, half)))?;
        let next = window_around(&spread, least_half);
        let change = [
            spread.middle[0] - middle[0],
            spread.middle[1] - middle[1],
            next[0] - half[0],
            next[1] - half[1],
        ];
        (middle, half) = (spread.middle, next);
        found = Some(spread);
        if change.iter().all(|change| change.abs() < REST) {
            break;
        }
    }
    found
}

/// Where an upright window of the least size holds most, and how much.
pub(crate) fn fullest(moments: &Moments, least_half: f64) -> Option<(f64, [f64; 2])> {
    let [width, height] = moments.size();
    let step = (least_half / 2.0).max(1.0) as usize;
    let positions = (0..height)
        .step_by(step)
        .flat_map(|y| (0..width).step_by(step).map(move |x| [x as f64, y as f64]));
    let mass = |at: [f64; 2]| (moments.sums(&moments.bounds(at, [least_half; 2]))[0], at);
    positions.map(mass).max_by(|a, b| a.0.total_cmp(&b.0))
}
