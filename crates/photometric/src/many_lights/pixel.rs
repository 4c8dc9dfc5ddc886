//! One pixel under many lights.

use geometry::nalgebra::{Matrix3, SMatrix, SVector, Unit, Vector3};

use super::ManyLightOptions;

/// Coefficients of the reflectance.
const TERMS: usize = 9;
/// Fewer samples do not hold nine coefficients and a normal.
const LEAST_SAMPLES: usize = 14;
/// A light this near the surface's horizon says little.
const LEAST_COSINE: f64 = 0.15;
/// Keeps coefficients small that the samples say nothing of: share of the largest diagonal element.
const RIDGE: f64 = 1e-4;
/// A smaller change of the normal ends the search.
const STILL: f64 = 1e-4;

/// Lights, and what of them does not depend on the pixel.
pub(super) struct Geometry {
    lights: Vec<Vector3<f64>>,
    /// Between each light and the camera.
    halves: Vec<Vector3<f64>>,
    to_camera: Vector3<f64>,
}

impl Geometry {
    pub(super) fn new(directions: &[Unit<Vector3<f64>>], to_camera: Unit<Vector3<f64>>) -> Self {
        let lights: Vec<Vector3<f64>> = directions.iter().map(|direction| direction.into_inner()).collect();
        let half = |light: &Vector3<f64>| (light + to_camera.into_inner()).normalize();
        Self {
            halves: lights.iter().map(half).collect(),
            lights,
            to_camera: to_camera.into_inner(),
        }
    }

    /// None when too few samples count.
    pub(super) fn solve(&self, samples: &[f64], options: &ManyLightOptions) -> Option<Vector3<f64>> {
        let mut ranked: Vec<usize> = (0..samples.len()).filter(|&light| samples[light].is_finite()).collect();
        // Equal samples, as in shadows, rank by their lights, so that the order in which these are given does not matter.
        let place = |light: usize| self.lights[light];
        ranked.sort_by(|&a, &b| {
            let (p, q) = (place(a), place(b));
            samples[a]
                .total_cmp(&samples[b])
                .then(p.z.total_cmp(&q.z))
                .then(p.x.total_cmp(&q.x))
                .then(p.y.total_cmp(&q.y))
        });
        let at = |share: f64| (share * ranked.len() as f64).round() as usize;
        let kept = &ranked[at(options.darkest)..at(options.brightest)];
        if kept.len() < LEAST_SAMPLES {
            return None;
        }
        // In units of the brightest that counts, so that the limits below mean the same at any exposure.
        let unit = samples[*kept.last()?];
        if unit <= 0.0 {
            return None;
        }
        let samples: Vec<f64> = samples.iter().map(|sample| sample / unit).collect();
        let samples = samples.as_slice();
        let mut normal = self.lambertian(samples, kept)?;
        for _ in 0..options.rounds {
            let Some(next) = self.improve(&normal, samples, kept) else {
                break;
            };
            let change = (next - normal).norm();
            normal = next;
            if change < STILL {
                break;
            }
        }
        Some(normal)
    }

    /// Least squares as if the surface were matte.
    fn lambertian(&self, samples: &[f64], kept: &[usize]) -> Option<Vector3<f64>> {
        let shaded: Vec<(Vector3<f64>, f64)> = kept.iter().map(|&light| (self.lights[light], samples[light])).collect();
        self.facing(least_squares(&shaded)?)
    }

    /// The reflectance that fits the normal, then the normal that fits the reflectance.
    fn improve(&self, normal: &Vector3<f64>, samples: &[f64], kept: &[usize]) -> Option<Vector3<f64>> {
        let lit: Vec<usize> = kept
            .iter()
            .copied()
            .filter(|&light| normal.dot(&self.lights[light]) > LEAST_COSINE)
            .collect();
        if lit.len() < LEAST_SAMPLES {
            return None;
        }
        let coefficients = self.coefficients(normal, samples, &lit)?;
        let shaded: Vec<(Vector3<f64>, f64)> = lit
            .iter()
            .map(|&light| {
                let reflectance = self.terms(normal, light).dot(&coefficients).max(1e-6);
                (self.lights[light] * reflectance, samples[light])
            })
            .collect();
        self.facing(least_squares(&shaded)?)
    }

    /// `(n·h)^i (l·h)^j`.
    fn terms(&self, normal: &Vector3<f64>, light: usize) -> SVector<f64, TERMS> {
        let half = &self.halves[light];
        let (x, y) = (normal.dot(half), self.lights[light].dot(half));
        let (xs, ys) = ([1.0, x, x * x], [1.0, y, y * y]);
        SVector::from_fn(|term, _| xs[term / 3] * ys[term % 3])
    }

    fn coefficients(&self, normal: &Vector3<f64>, samples: &[f64], lit: &[usize]) -> Option<SVector<f64, TERMS>> {
        let (mut matrix, mut right) = (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::<f64, TERMS>::zeros());
        for &light in lit {
            let row = self.terms(normal, light) * normal.dot(&self.lights[light]);
            matrix += row * row.transpose();
            right += row * samples[light];
        }
        let ridge = RIDGE * matrix.diagonal().amax();
        for term in 0..TERMS {
            matrix[(term, term)] += ridge;
        }
        Some(matrix.cholesky()?.solve(&right))
    }

    /// As a unit vector, if it faces the camera.
    fn facing(&self, scaled: Vector3<f64>) -> Option<Vector3<f64>> {
        let normal = scaled.try_normalize(1e-12)?;
        (normal.dot(&self.to_camera) > 0.0).then_some(normal)
    }
}

fn least_squares(rows: &[(Vector3<f64>, f64)]) -> Option<Vector3<f64>> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (row, value) in rows {
        matrix += row * row.transpose();
        right += row * *value;
    }
    Some(matrix.cholesky()?.solve(&right))
}
