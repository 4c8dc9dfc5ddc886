//! What a view says of the surface under the cup.

use std::f64::consts::TAU;

use geometry::nalgebra::Vector3;

use crate::chart::{Blurred, Chart};
use crate::specks::SPECK;

/// Places on the rim, and rings from the middle to it, at which slopes are read.
const SPOKES: usize = 32;
const RINGS: usize = 6;

/// The cup's place on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Circle {
    /// Metres.
    pub(crate) radius: f64,
    /// An edge pixel counts as a line of this width, metres.
    pub(crate) edge_width: f64,
    /// Cosine at which a surface has folded away.
    pub(crate) fold: f64,
}

/// Measured over a circle about a chart's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Footprint {
    /// Share of the area that edges cover (zeroth moment).
    pub(crate) edge_share: f64,
    /// Length of the edges' first moment: that share times distance of its middle over the radius.
    pub(crate) edge_moment: f64,
    /// Mean over the area, 0 where there is no normal.
    pub(crate) confidence: f64,
    /// Weighted by confidence, base frame, unit; the chart's own where there is none.
    pub(crate) normal: Vector3<f64>,
    /// What the lip and the bellows must give: largest difference of heights along the rim, or of rim and middle.
    pub(crate) gap: f64,
    /// From the middle to where the patch ends; at most the chart's reach. Metres.
    pub(crate) border: f64,
}

impl Footprint {
    pub(crate) fn measure(chart: &Chart, circle: &Circle) -> Self {
        let (edge_share, edge_moment) = edge_moments(chart, circle);
        let (confidence, normal) = mean(chart, circle.radius);
        Self {
            edge_share,
            edge_moment,
            confidence,
            normal,
            gap: gap(&chart.blurred(), circle.radius),
            border: border(chart, circle.fold),
        }
    }
}

fn edge_moments(chart: &Chart, circle: &Circle) -> (f64, f64) {
    let (mut zeroth, mut first) = (0.0, [0.0_f64; 2]);
    for edge in &chart.edges {
        if edge.x.hypot(edge.y) <= circle.radius {
            zeroth += edge.weight;
            first = [first[0] + edge.weight * edge.x, first[1] + edge.weight * edge.y];
        }
    }
    // A pixel of a line stands for its own length of line, as wide as edges count.
    let pixel = 1.0 / chart.density.max(1.0).sqrt();
    let area = std::f64::consts::PI * circle.radius * circle.radius;
    let share = pixel * circle.edge_width / area;
    (
        (zeroth * share).min(1.0),
        first[0].hypot(first[1]) * share / circle.radius,
    )
}

fn mean(chart: &Chart, radius: f64) -> (f64, Vector3<f64>) {
    let (mut confidence, mut normal, mut count) = (0.0, Vector3::zeros(), 0_usize);
    for (index, cell) in chart.cells.iter().enumerate() {
        let [x, y] = chart.grid.position(index);
        if x * x + y * y <= radius * radius {
            count += 1;
            let trust = f64::from(cell.confidence);
            confidence += trust;
            normal += Vector3::from(cell.normal.map(f64::from)) * trust;
        }
    }
    let tangent = &chart.tangent;
    let turned = tangent.u * normal.x + tangent.v * normal.y + tangent.normal * normal.z;
    (
        confidence / count.max(1) as f64,
        turned.try_normalize(1e-9).unwrap_or(tangent.normal),
    )
}

/// Heights by adding up slopes, around the rim and from the middle to it. What does not close around the rim is spread
/// over it: it is noise, or a step, and steps are for the edges. The normals are blurred, as a lip is wider than a pixel.
fn gap(chart: &Blurred, radius: f64) -> f64 {
    let along = |spoke: usize| {
        let (sin, cos) = (TAU * spoke as f64 / SPOKES as f64).sin_cos();
        (cos, sin)
    };
    let rim: Vec<f64> = (0..SPOKES)
        .map(|spoke| {
            let (cos, sin) = along(spoke);
            let [p, q] = slopes(chart, radius * cos, radius * sin);
            (q * cos - p * sin) * radius * TAU / SPOKES as f64
        })
        .collect();
    let excess = rim.iter().sum::<f64>() / SPOKES as f64;
    let (mut height, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
    for rise in rim {
        height += rise - excess;
        low = low.min(height);
        high = high.max(height);
    }
    let spoke = |spoke: usize| {
        let (cos, sin) = along(spoke);
        let step = radius / RINGS as f64;
        let rises = (0..RINGS).map(|ring| {
            let at = (ring as f64 + 0.5) * step;
            let [p, q] = slopes(chart, at * cos, at * sin);
            (p * cos + q * sin) * step
        });
        rises.sum::<f64>()
    };
    let dome = (0..SPOKES).map(spoke).sum::<f64>() / SPOKES as f64;
    (high - low).max(dome.abs())
}

/// Rise along u and along v; level where there is no normal.
fn slopes(chart: &Blurred, x: f64, y: f64) -> [f64; 2] {
    let [nu, nv, n, _] = chart.interpolated(x, y).map(f64::from);
    if n > 0.1 { [-nu / n, -nv / n] } else { [0.0; 2] }
}

fn border(chart: &Chart, fold: f64) -> f64 {
    let open = chart.open(fold, SPECK);
    let closed = (0..open.len()).filter(|&index| !open[index]);
    let squared = closed.map(|index| {
        let [x, y] = chart.grid.position(index);
        x * x + y * y
    });
    let nearest = squared.fold(f64::INFINITY, f64::min).sqrt();
    (nearest - chart.grid.pitch / 2.0).clamp(0.0, chart.grid.reach())
}
