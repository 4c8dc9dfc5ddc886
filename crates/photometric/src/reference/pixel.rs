//! One pixel of the published method.

use geometry::nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use crate::calibration::PolynomialRig;

/// A light whose weight is below this is taken to be in shadow.
const SHADOWED: f64 = 0.5;
/// Relative misfit at which a light's weight has fallen to a half.
const TOLERANCE: f64 = 0.15;
/// Gauss-Newton steps of a round.
const STEPS: usize = 2;

/// The models at a pixel's place: vectors, and the quadratic form's nine coefficients; ring lights only.
pub(super) struct Lights {
    vectors: Vec<Vector3<f64>>,
    coefficients: Vec<[f64; 9]>,
}

/// What is known of a pixel.
#[derive(Debug, Clone)]
pub(super) struct PixelState {
    pub(super) normal: Vector3<f64>,
    pub(super) albedo: f64,
    /// Root mean square relative misfit of the lights that count.
    pub(super) misfit: f64,
    signal: Vec<f64>,
    weights: Vec<f64>,
}

impl Lights {
    pub(super) fn at(rig: &PolynomialRig, place: [f64; 2]) -> Self {
        let ring = &rig.lights[..rig.lights.len() - 1];
        Self {
            vectors: ring.iter().map(|light| light.vector(place)).collect(),
            coefficients: ring.iter().map(|light| light.coefficients(place)).collect(),
        }
    }

    /// Intensity by the quadratic model, and its gradient by the normal.
    fn quadratic(&self, light: usize, normal: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let c = &self.coefficients[light];
        let (x, y, z) = (normal.x, normal.y, normal.z);
        let linear = c[0] + c[1] * x + c[2] * y + c[3] * z;
        let mixed = c[4] * x * y + c[5] * y * z + c[6] * z * x;
        let value = linear + mixed + c[7] * (x * x - y * y) + c[8] * (3.0 * z * z - 1.0);
        let gradient = Vector3::new(
            c[1] + c[4] * y + c[6] * z + 2.0 * c[7] * x,
            c[2] + c[4] * x + c[5] * z - 2.0 * c[7] * y,
            c[3] + c[5] * y + c[6] * x + 6.0 * c[8] * z,
        );
        (value, gradient)
    }
}

impl PixelState {
    /// Least squares with one vector per light; the last signal is the overhead light's.
    pub(super) fn start(lights: &Lights, signal: Vec<f64>) -> Self {
        let overhead = signal.last().copied().unwrap_or(0.0);
        let ring = &signal[..signal.len() - 1];
        let mut weights: Vec<f64> = ring.iter().map(|&i| if i > overhead { 1.0 } else { 0.0 }).collect();
        if weights.iter().sum::<f64>() < 3.0 {
            // Too few to solve: the three brightest.
            let mut sorted = ring.to_vec();
            sorted.sort_by(f64::total_cmp);
            let third = sorted[sorted.len() - 3];
            weights = ring.iter().map(|&i| if i >= third { 1.0 } else { 0.0 }).collect();
        }
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for ((vector, weight), signal) in lights.vectors.iter().zip(&weights).zip(ring) {
            matrix += vector * vector.transpose() * *weight;
            right += vector * (weight * signal);
        }
        let scaled = matrix.cholesky().map(|factor| factor.solve(&right));
        let scaled = scaled.filter(|scaled| scaled.norm() > 0.0 && scaled.norm().is_finite());
        let scaled = scaled.unwrap_or(Vector3::repeat(f64::NAN));
        Self {
            normal: scaled / scaled.norm(),
            albedo: scaled.norm(),
            misfit: f64::NAN,
            signal,
            weights,
        }
    }

    /// Normal and albedo with the weights held, then the weights with these held.
    pub(super) fn step(&self, lights: &Lights, neighbours: Option<Vector3<f64>>, smoothness: f64) -> Self {
        let mut next = self.clone();
        if !self.normal.x.is_finite() {
            return next;
        }
        for _ in 0..STEPS {
            next.refine(lights, neighbours, smoothness);
        }
        next.weigh(lights);
        next
    }

    /// A Gauss-Newton step on normal and log albedo, relative misfits, drawn towards the neighbours' mean.
    fn refine(&mut self, lights: &Lights, neighbours: Option<Vector3<f64>>, smoothness: f64) {
        let brightest = self.signal.iter().copied().fold(1e-9, f64::max);
        let (mut matrix, mut right) = (Matrix4::identity() * 1e-9, Vector4::zeros());
        for (light, weight) in self.weights.iter().enumerate() {
            let (value, gradient) = lights.quadratic(light, &self.normal);
            let predicted = self.albedo * value;
            let misfit = (self.signal[light] - predicted) / brightest;
            let slope = gradient * (self.albedo / brightest);
            let row = Vector4::new(slope.x, slope.y, slope.z, predicted / brightest);
            matrix += row * row.transpose() * *weight;
            right += row * (weight * misfit);
        }
        if let Some(mean) = neighbours {
            let pull = mean - self.normal;
            for axis in 0..3 {
                matrix[(axis, axis)] += smoothness;
                right[axis] += smoothness * pull[axis];
            }
        }
        let Some(step) = matrix.cholesky().map(|factor| factor.solve(&right)) else {
            return;
        };
        let step = step * (0.3 / step.norm().max(0.3));
        let moved = self.normal + step.xyz();
        if let Some(normal) = moved.try_normalize(1e-9) {
            self.normal = normal;
            self.albedo *= step.w.exp();
        }
    }

    /// Lights that are darker than predicted lose weight.
    fn weigh(&mut self, lights: &Lights) {
        let brightest = self.signal.iter().copied().fold(1e-9, f64::max);
        let (mut squares, mut total) = (0.0, 0.0);
        for light in 0..self.weights.len() {
            let (value, _) = lights.quadratic(light, &self.normal);
            let misfit = (self.signal[light] - self.albedo * value) / brightest;
            let darker = (-misfit).max(0.0) / TOLERANCE;
            self.weights[light] = 1.0 / (1.0 + darker * darker);
            squares += self.weights[light] * misfit * misfit;
            total += self.weights[light];
        }
        self.misfit = (squares / total.max(1e-9)).sqrt();
    }

    /// 0 to 1: lights that count, and how well they fit.
    pub(super) fn confidence(&self) -> f64 {
        let lights = (f64::from(self.used()) - 1.0).clamp(0.0, 3.0) / 3.0;
        lights / (1.0 + (self.misfit / TOLERANCE).powi(2))
    }

    pub(super) fn used(&self) -> u8 {
        self.weights.iter().filter(|weight| **weight > SHADOWED).count() as u8
    }

    /// Bit i: light i is in shadow; the overhead light is never said to be.
    pub(super) fn shadows(&self) -> u8 {
        let bits = self.weights.iter().enumerate().take(8);
        bits.filter(|(_, weight)| **weight <= SHADOWED)
            .fold(0, |all, (light, _)| all | 1 << light)
    }
}
