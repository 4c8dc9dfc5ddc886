//! How well a normal explains one pixel's samples, and the normal that explains them best.

use glam::{Mat3, Vec3};

use super::light_field::{LightAt, MAX_PANELS};

/// The model is good to this share of a prediction; panels are not quite uniform, surfaces not quite matte.
const MODEL_ERROR: f32 = 0.015;
/// Light bounced by the object itself is taken to be up to some of this share of the pixel's brightest sample.
const BOUNCE_SHARE: f32 = 0.03;
/// From so many sigmas on more light than predicted is taken for bounced light (the scale of Cauchy's function).
const BOUNCE_TAIL: f32 = 3.0;
/// What it costs to call a light blocked, in units of half a squared sigma.
const SHADOW_COST: f32 = 6.0;
/// A surface seen in the image faces the camera.
const AWAY_COST: f32 = 40.0;

/// One pixel's samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixel {
    pub(crate) count: usize,
    /// Dark-subtracted, in units of the gain (irradiance times albedo); NaN when saturated.
    pub(crate) signal: [f32; MAX_PANELS],
    /// Their variance by noise alone.
    pub(crate) variance: [f32; MAX_PANELS],
    pub(crate) lights: [LightAt; MAX_PANELS],
    /// Light of the room: constant, linear.
    pub(crate) bounce: [(f32, Vec3); MAX_PANELS],
    /// From the surface to the camera.
    pub(crate) to_camera: Vec3,
    /// Brightest sample.
    pub(crate) brightest: f32,
}

/// A normal, how well it explains the samples, and how firmly it is held.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Estimate {
    pub(crate) normal: Vec3,
    pub(crate) albedo: f32,
    pub(crate) cost: f32,
    /// Bit i: light i does not reach the pixel.
    pub(crate) shadows: u8,
    /// Inverse covariance of the normal.
    pub(crate) information: Mat3,
    /// Sum of squared misfits of the lights that were used, in sigmas.
    pub(crate) misfit: f32,
    pub(crate) used: u8,
}

/// One light's part of the cost.
struct Term {
    cost: f32,
    /// Weight of the squared misfit in the next Gauss-Newton step; 0 in shadow.
    weight: f32,
    shadow: bool,
}

impl Pixel {
    /// Light of the room on a normal.
    #[inline]
    pub(crate) fn bounce_of(&self, light: usize, normal: Vec3) -> f32 {
        let (constant, linear) = self.bounce[light];
        (constant + linear.dot(normal)).max(0.0)
    }

    /// Cost of a sample against the direct and the room's light.
    #[inline]
    fn term(&self, light: usize, direct: f32, room: f32) -> Term {
        let signal = self.signal[light];
        let misfit = signal - direct - room;
        let model = MODEL_ERROR * (direct + room);
        let variance = self.variance[light] + model * model;
        if misfit <= 0.0 {
            let square = misfit * misfit / variance;
            // A light cannot be taken away but by shadow; in the half-shadow of a panel it is there in part.
            let blocked = SHADOW_COST + if signal - room > 0.2 * direct { 2.0 } else { 0.0 };
            if 0.5 * square < blocked {
                return Term {
                    cost: 0.5 * square,
                    weight: 1.0 / variance,
                    shadow: false,
                };
            }
            return Term {
                cost: blocked,
                weight: 0.0,
                shadow: true,
            };
        }
        // More light than predicted comes from neighbouring surfaces: rare when large, so its tail is long.
        let bounced = BOUNCE_SHARE * self.brightest;
        let square = misfit * misfit / variance;
        let tail = 1.0 + square / (BOUNCE_TAIL * BOUNCE_TAIL);
        let (cost, weight) = (0.5 * BOUNCE_TAIL * BOUNCE_TAIL * tail.ln(), 1.0 / (variance * tail));
        Term {
            cost,
            weight,
            shadow: direct < bounced * 0.2,
        }
    }

    /// Cost of a unit normal with an albedo.
    #[inline]
    pub(crate) fn cost(&self, normal: Vec3, albedo: f32) -> f32 {
        let mut cost = AWAY_COST * (-normal.dot(self.to_camera)).max(0.0);
        for light in 0..self.count {
            if self.signal[light].is_nan() {
                continue;
            }
            let direct = albedo * self.lights[light].irradiance(normal);
            let room = albedo * self.bounce_of(light, normal);
            cost += self.term(light, direct, room).cost;
        }
        cost
    }

    /// Gauss-Newton steps on the sphere from a normal; `prior` is the inverse variance of the log albedo about 0.
    pub(crate) fn refine(&self, start: Vec3, albedo: f32, prior: f32, steps: usize) -> Estimate {
        let (mut normal, mut albedo) = (start, albedo);
        for _ in 0..steps {
            let (matrix, right) = self.normal_equations(normal, albedo, prior);
            let Some(step) = solve(matrix, right) else { break };
            let (tangent, across) = tangents(normal);
            let limited = step * (0.35 / step.length().max(0.35));
            normal = (normal + tangent * limited.x + across * limited.y).normalize();
            albedo = (albedo * limited.z.exp()).clamp(1e-3, 1e9);
        }
        self.estimate(normal, albedo, prior)
    }

    /// Rows: two tangent directions, log albedo.
    fn normal_equations(&self, normal: Vec3, albedo: f32, prior: f32) -> (Mat3, Vec3) {
        let (tangent, across) = tangents(normal);
        let mut matrix = Mat3::from_diagonal(Vec3::new(1e-3, 1e-3, prior));
        let mut right = Vec3::new(0.0, 0.0, -prior * albedo.ln());
        for light in 0..self.count {
            if self.signal[light].is_nan() {
                continue;
            }
            let (irradiance, gradient) = self.lights[light].gradient(normal);
            let (direct, room) = (albedo * irradiance, albedo * self.bounce_of(light, normal));
            let term = self.term(light, direct, room);
            if term.weight <= 0.0 {
                continue;
            }
            let gradient = (gradient + self.bounce[light].1) * albedo;
            let row = Vec3::new(gradient.dot(tangent), gradient.dot(across), direct + room);
            let misfit = self.signal[light] - direct - room;
            matrix += outer(row, row * term.weight);
            right += row * (term.weight * misfit);
        }
        (matrix, right)
    }

    /// What is known at a normal.
    pub(crate) fn estimate(&self, normal: Vec3, albedo: f32, prior: f32) -> Estimate {
        let mut result = Estimate {
            normal,
            albedo,
            cost: AWAY_COST * (-normal.dot(self.to_camera)).max(0.0) + 0.5 * prior * albedo.ln().powi(2),
            shadows: 0,
            information: Mat3::ZERO,
            misfit: 0.0,
            used: 0,
        };
        for light in 0..self.count {
            if self.signal[light].is_nan() {
                continue;
            }
            let (irradiance, _) = self.lights[light].gradient(normal);
            let (direct, room) = (albedo * irradiance, albedo * self.bounce_of(light, normal));
            let term = self.term(light, direct, room);
            result.cost += term.cost;
            if term.shadow {
                result.shadows |= 1 << light;
                continue;
            }
            let misfit = self.signal[light] - direct - room;
            result.misfit += misfit * misfit * term.weight;
            result.used += 1;
        }
        let (matrix, _) = self.normal_equations(normal, albedo, prior);
        result.information = on_sphere(matrix, normal);
        result
    }
}

/// The tangential part of the normal equations with the albedo eliminated, as a 3 x 3 matrix in base axes.
fn on_sphere(matrix: Mat3, normal: Vec3) -> Mat3 {
    let (tangent, across) = tangents(normal);
    let to_albedo = matrix.z_axis;
    let firmness = to_albedo.z.max(1e-6);
    let along = matrix.x_axis.x - to_albedo.x * to_albedo.x / firmness;
    let mixed = matrix.x_axis.y - to_albedo.x * to_albedo.y / firmness;
    let aside = matrix.y_axis.y - to_albedo.y * to_albedo.y / firmness;
    outer(tangent, tangent * along + across * mixed) + outer(across, tangent * mixed + across * aside)
}

/// Two unit vectors at right angles to a normal (Duff et al., "Building an orthonormal basis, revisited", 2017).
#[inline]
pub(crate) fn tangents(normal: Vec3) -> (Vec3, Vec3) {
    normal.any_orthonormal_pair()
}

/// `column · rowᵀ`.
#[inline]
pub(crate) fn outer(column: Vec3, row: Vec3) -> Mat3 {
    Mat3::from_cols(column * row.x, column * row.y, column * row.z)
}

/// None when the matrix is singular.
#[inline]
pub(crate) fn solve(matrix: Mat3, right: Vec3) -> Option<Vec3> {
    let determinant = matrix.determinant();
    let size = matrix.x_axis.x.max(matrix.y_axis.y).max(matrix.z_axis.z);
    (determinant.abs() > 1e-12 * size * size * size).then(|| matrix.inverse() * right)
}
