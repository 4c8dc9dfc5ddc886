//! How far a surface lies over the plane on which two views were laid out.
//!
//! A point that stands δ over the plane is seen beside its place by δ times each view's slide, so the two charts agree
//! when both are read there. What is compared are the normal maps themselves: they are in one frame, know no texture and
//! no exposure, and end where the object ends. This is stereo by normals, swept over planes (Collins, "A space-sweep
//! approach to true multi-image matching", CVPR 1996, sweeps images).

use crate::chart::{Bend, Blurred};

/// Squared difference of normals from which a cell merely contradicts.
const CONTRADICTION: f64 = 1.0;

/// Where the charts agree best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Offset {
    /// Along the plane's normal, metres.
    pub(crate) height: f64,
    /// Share of contradiction left, 0 to 1.
    pub(crate) mismatch: f64,
    /// Half of the second derivative of the mismatch by height, per square metre; 0 where nothing tells the height.
    pub(crate) sharpness: f64,
}

/// Heights to be tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sweep {
    /// Metres over the plane.
    pub(crate) middle: f64,
    /// To both sides, metres.
    pub(crate) range: f64,
    /// Metres.
    pub(crate) step: f64,
    /// Every so many cells are read.
    pub(crate) stride: usize,
}

/// Best height of a sweep, between the steps by a parabola; none when the best one is at the sweep's end.
pub(crate) fn best_offset(a: &Blurred, b: &Blurred, bend: &Bend, sweep: &Sweep) -> Option<Offset> {
    let steps = (sweep.range / sweep.step).round() as i64;
    let places = places(a, bend, sweep.stride);
    let cost = |step: i64| mismatch(a, b, &places, sweep.middle + step as f64 * sweep.step);
    let costs: Vec<f64> = (-steps..=steps).map(cost).collect();
    let best = (0..costs.len()).min_by(|&i, &j| costs[i].total_cmp(&costs[j]))?;
    let middle = costs[best];
    let (before, after) = (*costs.get(best.checked_sub(1)?)?, *costs.get(best + 1)?);
    let bow = f64::midpoint(before, after) - middle;
    let shift = if bow > 0.0 { (before - after) / (4.0 * bow) } else { 0.0 };
    Some(Offset {
        height: sweep.middle + (best as f64 - steps as f64 + shift) * sweep.step,
        mismatch: middle,
        sharpness: bow / (sweep.step * sweep.step),
    })
}

/// A cell that is read, the same at all heights of a sweep.
struct Place {
    x: f64,
    y: f64,
    /// Over the plane, as the surface bends; metres.
    bend: f64,
    /// Less towards the border.
    weight: f64,
}

fn places(chart: &Blurred, bend: &Bend, stride: usize) -> Vec<Place> {
    let (grid, reach) = (chart.grid, chart.grid.reach());
    let place = |row: usize, column: usize| {
        let [x, y] = grid.position(row * grid.side() + column);
        Place {
            x,
            y,
            bend: bend.height(x, y),
            weight: (-2.0 * (x * x + y * y) / (reach * reach)).exp(),
        }
    };
    let rows = (0..grid.side()).step_by(stride);
    rows.flat_map(|row| (0..grid.side()).step_by(stride).map(move |column| place(row, column)))
        .collect()
}

/// Mean contradiction where at least one view has a surface, 0 to 1.
fn mismatch(a: &Blurred, b: &Blurred, places: &[Place], height: f64) -> f64 {
    let (mut sum, mut weights) = (0.0_f64, 0.0_f64);
    for &Place { x, y, bend, weight } in places {
        let over = height + bend;
        let read = |chart: &Blurred| chart.interpolated(x + over * chart.slide.x, y + over * chart.slide.y);
        let (in_a, in_b) = (read(a), read(b));
        let present = f64::from(in_a[3].max(in_b[3]));
        if present <= 0.0 {
            continue;
        }
        let difference: f32 = in_a.iter().zip(in_b).map(|(a, b)| (a - b) * (a - b)).sum();
        sum += weight * f64::from(difference).min(CONTRADICTION) / CONTRADICTION;
        weights += weight * present;
    }
    if weights > 0.0 { sum / weights } else { 1.0 }
}
