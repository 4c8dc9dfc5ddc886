//! How well a normal explains one pixel's samples, and the normal that explains them best.

use glam::{Mat3, Vec3};

use super::lanes::{Lanes, VectorLanes};
use super::light_field::LightAt;

/// The model is good to this share of a prediction; panels are not quite uniform, surfaces not quite matte.
const MODEL_ERROR: f32 = 0.015;
/// From so many sigmas on more light than predicted is taken for bounced light (the scale of Cauchy's function).
const BOUNCE_TAIL: f32 = 3.0;
/// What it costs to call a light blocked, in units of half a squared sigma.
const SHADOW_COST: f32 = 6.0;
/// What it costs beyond that when some of the light is there: a panel's half-shadow is narrow.
const HALF_SHADOW_COST: f32 = 2.0;
/// A light that gives less than this share of the brightest sample is as good as below the horizon.
const BELOW_HORIZON: f32 = 0.006;
/// A surface seen in the image faces the camera.
const AWAY_COST: f32 = 40.0;
/// Longest step of a fit, radians.
const LONGEST_STEP: f32 = 0.35;

/// After a shorter step the next one is far below the noise: radians, and of the log albedo.
const LAST_STEP: f32 = 0.03;

/// One pixel's samples; lanes without a panel, or with a saturated sample, have `valid` 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixel {
    /// Dark-subtracted, in units of the gain (irradiance times albedo).
    pub(crate) signal: Lanes,
    /// Their variance by noise alone.
    pub(crate) variance: Lanes,
    /// 1 or 0.
    pub(crate) valid: Lanes,
    pub(crate) lights: LightAt,
    /// Light of the room: constant.
    pub(crate) room: Lanes,
    /// Light by way of the object itself.
    pub(crate) bounced: Lanes,
    /// Light of the room: linear in the normal.
    pub(crate) room_linear: VectorLanes,
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

impl Estimate {
    /// Of a pixel of which nothing can be said.
    pub(crate) const UNKNOWN: Self = Self {
        normal: Vec3::NAN,
        albedo: f32::NAN,
        cost: f32::INFINITY,
        shadows: 0,
        information: Mat3::ZERO,
        misfit: 0.0,
        used: 0,
    };

    /// Root mean square misfit of the lights that were used, in sigmas.
    pub(crate) fn residual(&self) -> f32 {
        (self.misfit / f32::from(self.used.max(1))).sqrt()
    }

    /// 0 to 1: less for each light short of four, and for misfits beyond the noise.
    pub(crate) fn confidence(&self) -> f32 {
        let lights = f32::from(self.used.saturating_sub(1)) / 3.0;
        lights.min(1.0) / (1.0 + (self.residual() / 3.0).powi(2))
    }
}

/// Every light's prediction and what it is worth.
#[derive(Clone, Copy)]
struct Terms {
    direct: Lanes,
    /// Of the panel that is above the horizon.
    share: Lanes,
    room: Lanes,
    misfit: Lanes,
    /// Squared, in sigmas.
    square: Lanes,
    /// What calling the light blocked costs.
    blocked: Lanes,
    /// Of the squared misfit in the next Gauss-Newton step; 0 in shadow.
    weight: Lanes,
}

/// More light than predicted comes from neighbouring surfaces: rare when large, so its tail is long.
#[inline]
fn tail(square: Lanes) -> Lanes {
    Lanes::ONE + square * (1.0 / (BOUNCE_TAIL * BOUNCE_TAIL))
}

impl Terms {
    /// In units of half a squared sigma.
    #[inline]
    fn cost(&self) -> f32 {
        let is_darker = self.misfit.simd_le(Lanes::ZERO);
        let darker = (self.square * 0.5).fast_min(self.blocked);
        let brighter = tail(self.square).ln() * (0.5 * BOUNCE_TAIL * BOUNCE_TAIL);
        is_darker.blend(darker, brighter).reduce_add()
    }
}

impl Pixel {
    #[inline]
    fn terms(&self, normal: Vec3, albedo: f32) -> Terms {
        let (irradiance, share) = self.lights.irradiance(normal);
        let direct = irradiance * albedo;
        let room = (self.room + self.room_linear.dot(normal)).fast_max(Lanes::ZERO);
        let room = (room + self.bounced) * albedo;
        let predicted = direct + room;
        let misfit = self.signal - predicted;
        let model = predicted * MODEL_ERROR;
        let certainty = self.valid / (self.variance + model * model);
        let square = misfit * misfit * certainty;
        // A light cannot be taken away but by shadow; in the half-shadow of a panel it is there in part.
        let is_half = (self.signal - room).simd_gt(direct * 0.2);
        let blocked = Lanes::splat(SHADOW_COST) + is_half.blend(Lanes::splat(HALF_SHADOW_COST), Lanes::ZERO);
        let is_darker = misfit.simd_le(Lanes::ZERO);
        let is_blocked = is_darker & (square * 0.5).simd_ge(blocked);
        let weight = is_darker.blend(certainty, certainty / tail(square));
        Terms {
            direct,
            share,
            room,
            misfit,
            square,
            blocked,
            weight: is_blocked.blend(Lanes::ZERO, weight),
        }
    }

    /// Cost of a unit normal with an albedo.
    #[inline]
    pub(crate) fn cost(&self, normal: Vec3, albedo: f32) -> f32 {
        self.away(normal) + self.terms(normal, albedo).cost()
    }

    #[inline]
    fn away(&self, normal: Vec3) -> f32 {
        AWAY_COST * (-normal.dot(self.to_camera)).max(0.0)
    }

    /// Gauss-Newton steps on the sphere from a normal; `prior` is the inverse variance of the log albedo about 0.
    #[inline]
    pub(crate) fn refine(&self, start: Vec3, albedo: f32, prior: f32, steps: usize) -> Estimate {
        let (mut normal, mut albedo) = (start, albedo);
        for _ in 0..steps {
            let terms = self.terms(normal, albedo);
            let (matrix, right) = self.normal_equations(&terms, normal, albedo, prior);
            let Some(step) = solve(matrix, right) else { break };
            let (tangent, across) = tangents(normal);
            let limited = step * (LONGEST_STEP / step.length().max(LONGEST_STEP));
            normal = (normal + tangent * limited.x + across * limited.y).normalize();
            albedo = (albedo * limited.z.exp()).clamp(1e-3, 1e9);
            if limited.length_squared() < LAST_STEP * LAST_STEP {
                break;
            }
        }
        self.estimate(normal, albedo, prior)
    }

    /// Rows: two tangent directions, log albedo.
    #[inline]
    fn normal_equations(&self, terms: &Terms, normal: Vec3, albedo: f32, prior: f32) -> (Mat3, Vec3) {
        let (tangent, across) = tangents(normal);
        let slope = |direction: Vec3| {
            (terms.share * self.lights.vector.dot(direction) + self.room_linear.dot(direction)) * albedo
        };
        let (along, aside, bright) = (slope(tangent), slope(across), terms.direct + terms.room);
        let (weighted, held) = (along * terms.weight, aside * terms.weight);
        let shining = bright * terms.weight;
        let (xy, xz) = ((weighted * aside).reduce_add(), (weighted * bright).reduce_add());
        let yz = (held * bright).reduce_add();
        let matrix = Mat3::from_cols(
            Vec3::new((weighted * along).reduce_add() + 1e-3, xy, xz),
            Vec3::new(xy, (held * aside).reduce_add() + 1e-3, yz),
            Vec3::new(xz, yz, (shining * bright).reduce_add() + prior),
        );
        let right = Vec3::new(
            (weighted * terms.misfit).reduce_add(),
            (held * terms.misfit).reduce_add(),
            (shining * terms.misfit).reduce_add() - prior * albedo.ln(),
        );
        (matrix, right)
    }

    /// What is known at a normal.
    #[inline]
    pub(crate) fn estimate(&self, normal: Vec3, albedo: f32, prior: f32) -> Estimate {
        let terms = self.terms(normal, albedo);
        let (matrix, _) = self.normal_equations(&terms, normal, albedo, prior);
        let is_valid = self.valid.simd_gt(Lanes::ZERO);
        let dim = Lanes::splat(BELOW_HORIZON * self.brightest);
        let is_used = is_valid & terms.weight.simd_gt(Lanes::ZERO) & terms.direct.simd_ge(dim);
        let square = is_used.blend(terms.misfit * terms.misfit * terms.weight, Lanes::ZERO);
        let (valid, used) = (is_valid.to_bitmask() as u8, is_used.to_bitmask() as u8);
        Estimate {
            normal,
            albedo,
            cost: self.away(normal) + 0.5 * prior * albedo.ln().powi(2) + terms.cost(),
            shadows: valid & !used,
            information: on_sphere(matrix, normal),
            misfit: square.reduce_add(),
            used: used.count_ones() as u8,
        }
    }
}

/// The tangential part of the normal equations with the albedo eliminated, as a 3 x 3 matrix in base axes.
#[inline]
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Six lights around and one above, some samples brighter than a level surface shows and some darker.
    fn pixel(samples: [f32; 7]) -> Pixel {
        let mut lights = LightAt::default();
        let mut pixel = Pixel {
            signal: Lanes::ZERO,
            // So large that the model's own error, which the slopes leave out, does not count.
            variance: Lanes::splat(0.04),
            valid: Lanes::ZERO,
            lights,
            room: Lanes::splat(0.05),
            bounced: Lanes::ZERO,
            room_linear: VectorLanes::default(),
            to_camera: Vec3::Z,
            brightest: 1.0,
        };
        for (lane, sample) in samples.into_iter().enumerate() {
            let (sine, cosine) = (lane as f32 * std::f32::consts::FRAC_PI_3).sin_cos();
            let ring = Vec3::new(cosine, sine, 0.6);
            lights.vector.set(lane, if lane < 6 { ring } else { Vec3::Z });
            pixel.room_linear.set(lane, Vec3::new(0.01, -0.02, 0.03));
            pixel.signal.as_mut_array()[lane] = sample;
            pixel.valid.as_mut_array()[lane] = 1.0;
        }
        pixel.lights = lights;
        pixel
    }

    proptest! {
        #[test]
        fn the_step_goes_down_the_cost(
            x in -0.25_f32..0.25, y in -0.25_f32..0.25, albedo in 0.8_f32..1.2, samples: [f32; 7],
        ) {
            let normal = Vec3::new(x, y, 1.0).normalize();
            let (tangent, across) = tangents(normal);
            let step = 1e-2;
            let turned = |by: Vec3| (normal + by * step).normalize();
            let pixel = pixel(samples.map(|sample| 0.3 + sample.abs() % 0.9));
            // A light in doubt between lit and blocked has no slope.
            let shone = |by: f32| albedo * (by * step).exp();
            let lit = |normal: Vec3, albedo: f32| {
                let terms = pixel.terms(normal, albedo);
                (terms.weight.simd_gt(Lanes::ZERO).to_bitmask(), terms.blocked.to_array())
            };
            let turns = [tangent, -tangent, across, -across].map(|by| lit(turned(by), albedo));
            let shines = [1.0, -1.0].map(|by| lit(normal, shone(by)));
            prop_assume!(turns.iter().chain(&shines).all(|lanes| *lanes == lit(normal, albedo)));
            let slope = |by: Vec3| {
                (pixel.cost(turned(by), albedo) - pixel.cost(turned(-by), albedo)) / (2.0 * step)
            };
            let shine = (pixel.cost(normal, shone(1.0)) - pixel.cost(normal, shone(-1.0))) / (2.0 * step);
            let (_, right) = pixel.normal_equations(&pixel.terms(normal, albedo), normal, albedo, 0.0);
            let downhill = -Vec3::new(slope(tangent), slope(across), shine);
            let scale = right.length().max(2.0);
            prop_assert!((right - downhill).length() < 0.05 * scale, "{right} but {downhill}");
        }
    }
}
