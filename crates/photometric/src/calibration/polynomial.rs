//! The published system's light models: the intensity of a light as a polynomial of the normal whose coefficients vary
//! over the table.
//!
//! With the normal n and the place (x, y) on the table:
//!
//! ```text
//! linear      I = l(x, y) · n                               l: three coefficients
//! quadratic   I = ñᵀ Q(x, y) ñ,  ñ = (n, 1)                  Q: 4 x 4, nine coefficients (Ramamoorthi, Hanrahan 2001)
//! ```
//!
//! Every coefficient is bi-quadratic in x and y.

use geometry::nalgebra::{DMatrix, DVector, Point3, Vector3};
use rayon::prelude::*;

use crate::light_rig::{LightRig, PanelModel};

/// Terms of the variation over the table.
const PLACES: usize = 9;
/// Terms of the linear model.
const LINEAR: usize = 3;
/// Terms of the quadratic model.
const QUADRATIC: usize = 9;
/// Middle of the table and half its size, metres: what makes x and y run from -1 to 1.
const CENTRE: [f64; 2] = [0.43, 0.0];
const HALF_SIZE: [f64; 2] = [0.23, 0.305];
/// Keeps coefficients small that the samples say nothing of: share of the largest diagonal element.
const RIDGE: f64 = 1e-6;

/// One light's models.
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialLight {
    /// The light's number, 1 for L1.
    pub channel: u8,
    linear: Vec<f64>,
    quadratic: Vec<f64>,
}

/// Every light's models, ascending by channel.
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialRig {
    /// The lights.
    pub lights: Vec<PolynomialLight>,
}

/// A sample of one light: place, unit normal, intensity relative to the view's gain.
pub(super) type Sample = ([f64; 2], Vector3<f64>, f64);

impl PolynomialRig {
    /// Models of calibrated panels, as if a target had been looked at everywhere over the table: normals up to 80 degrees
    /// from the vertical, heights of a usual object.
    pub fn from_panels(rig: &LightRig) -> Self {
        let fit = |panel: &PanelModel| {
            let samples: Vec<Sample> = target_points()
                .map(|(point, normal)| ([point.x, point.y], normal, panel.irradiance(&point, &normal)))
                .collect();
            PolynomialLight::fit(panel.channel, &samples)
        };
        Self {
            lights: rig.panels().par_iter().map(fit).collect(),
        }
    }
}

/// Places on a grid over the table, each with a spread of normals.
fn target_points() -> impl Iterator<Item = (Point3<f64>, Vector3<f64>)> {
    let places = (0..49).map(|k| [f64::from(k % 7) / 3.0 - 1.0, f64::from(k / 7) / 3.0 - 1.0]);
    places.flat_map(|place| {
        let [x, y] = [0, 1].map(|axis| CENTRE[axis] + 0.8 * HALF_SIZE[axis] * place[axis]);
        (0..60).map(move |k| {
            let z = 1.0 - 0.83 * (f64::from(k) + 0.5) / 60.0;
            let (sin, cos) = (f64::from(k) * 2.399_963).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            (Point3::new(x, y, 0.015), Vector3::new(radius * cos, radius * sin, z))
        })
    })
}

impl PolynomialLight {
    /// Least squares; the linear model sees only what is lit, the quadratic one everything.
    pub(super) fn fit(channel: u8, samples: &[Sample]) -> Self {
        let brightest = samples.iter().map(|sample| sample.2).fold(0.0, f64::max);
        let lit: Vec<Sample> = samples
            .iter()
            .copied()
            .filter(|sample| sample.2 > 0.1 * brightest)
            .collect();
        Self {
            channel,
            linear: solve(&lit, LINEAR, &linear_terms),
            quadratic: solve(samples, QUADRATIC, &quadratic_terms),
        }
    }

    /// The linear model's vector at a place, base frame: its product with a normal is the intensity.
    pub fn vector(&self, place: [f64; 2]) -> Vector3<f64> {
        let coefficients = at(&self.linear, LINEAR, place);
        Vector3::new(coefficients[0], coefficients[1], coefficients[2])
    }

    /// The quadratic model's nine coefficients at a place, of 1, x, y, z, xy, yz, zx, x² - y², 3z² - 1.
    pub fn coefficients(&self, place: [f64; 2]) -> [f64; QUADRATIC] {
        let all = at(&self.quadratic, QUADRATIC, place);
        std::array::from_fn(|term| all[term])
    }

    /// Intensity of a unit normal at a place by the quadratic model.
    pub fn intensity(&self, place: [f64; 2], normal: &Vector3<f64>) -> f64 {
        let terms = quadratic_terms(normal);
        self.coefficients(place).iter().zip(terms).map(|(a, b)| a * b).sum()
    }
}

fn linear_terms(normal: &Vector3<f64>) -> Vec<f64> {
    normal.iter().copied().collect()
}

fn quadratic_terms(n: &Vector3<f64>) -> Vec<f64> {
    let (x, y, z) = (n.x, n.y, n.z);
    vec![1.0, x, y, z, x * y, y * z, z * x, x * x - y * y, 3.0 * z * z - 1.0]
}

fn place_terms(place: [f64; 2]) -> [f64; PLACES] {
    let [x, y] = [0, 1].map(|axis| (place[axis] - CENTRE[axis]) / HALF_SIZE[axis]);
    let (along, across) = ([1.0, x, x * x], [1.0, y, y * y]);
    std::array::from_fn(|term| along[term / 3] * across[term % 3])
}

/// Coefficients of the normal's terms at a place.
fn at(all: &[f64], terms: usize, place: [f64; 2]) -> Vec<f64> {
    let weights = place_terms(place);
    let of_term = |term: usize| {
        weights
            .iter()
            .enumerate()
            .map(|(k, weight)| weight * all[k * terms + term])
            .sum()
    };
    (0..terms).map(of_term).collect()
}

fn solve(samples: &[Sample], terms: usize, of_normal: &dyn Fn(&Vector3<f64>) -> Vec<f64>) -> Vec<f64> {
    let size = PLACES * terms;
    let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for (place, normal, intensity) in samples {
        let (weights, values) = (place_terms(*place), of_normal(normal));
        let row = DVector::from_fn(size, |i, _| weights[i / terms] * values[i % terms]);
        matrix.syger(1.0, &row, &row, 1.0);
        right.axpy(*intensity, &row, 1.0);
    }
    matrix.fill_upper_triangle_with_lower_triangle();
    let ridge = RIDGE * matrix.diagonal().amax().max(f64::MIN_POSITIVE);
    for i in 0..size {
        matrix[(i, i)] += ridge;
    }
    let solved = matrix.cholesky().map(|factor| factor.solve(&right));
    solved.map_or_else(|| vec![0.0; size], |solution| solution.iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_that_is_quadratic_comes_back() {
        let truth = |[x, y]: [f64; 2], n: &Vector3<f64>| {
            (1.0 + x - y * x) * (0.3 + 0.5 * n.z + 0.2 * n.x) + 0.1 * x * n.x * n.y
        };
        let mut samples = Vec::new();
        for k in 0..2000 {
            let t = f64::from(k);
            let place = [0.43 + 0.2 * (t * 0.37).sin(), 0.25 * (t * 0.71).cos()];
            let normal = Vector3::new((t * 1.3).sin(), (t * 0.9).cos(), 0.4 + (t * 0.17).sin().abs()).normalize();
            samples.push((place, normal, truth(place, &normal)));
        }
        let light = PolynomialLight::fit(3, &samples);
        for (place, normal, intensity) in &samples {
            let off = (light.intensity(*place, normal) - intensity).abs();
            assert!(off < 2e-3, "{off}");
        }
    }
}
