//! Joint angles for a pose.
//!
//! Damped least squares on the pose's error (Levenberg and Marquardt's method in the form of Sugihara, "Solvability-
//! unconcerned inverse kinematics by the Levenberg-Marquardt method", IEEE T-RO 27(5), 2011: the damping follows the
//! squared error), joints at a limit taken out while the step pushes them on. What is left free, the redundancy, then
//! goes where [`Preference`] wants it. A start that ends in a local minimum is given up for a random one.

use geometry::RigidTransform;
use nalgebra::{Isometry3, SMatrix, SVector};

use crate::chain::{Chain, Jacobian, isometry};
use crate::error::KinematicsError;
use crate::preference::Preference;

/// Steps of one attempt; those that succeed take some ten.
const MOST_STEPS: usize = 60;
/// An attempt whose error has not halved in so many steps is stuck.
const PATIENCE: usize = 12;
/// Damping at no error, and in units of the squared error.
const DAMPING: [f64; 2] = [1e-10, 0.05];
/// Longest step of a joint, radians: the Jacobian holds no further.
const LONGEST_STEP: f64 = 0.6;
/// Solutions from random starts among which the nearest is taken.
const BRANCHES: usize = 4;
/// Steps along the redundancy.
const POLISH: usize = 6;
/// Random starts are the same every time.
const RANDOM_SEED: u64 = 0x7A11;

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IkOptions {
    /// Largest distance to the pose's origin, metres.
    pub position_tolerance: f64,
    /// Largest angle to the pose, radians.
    pub rotation_tolerance: f64,
    /// Starts that are tried: the seed, then random ones.
    pub attempts: usize,
    /// Where the redundancy goes.
    pub preference: Preference,
}

impl Default for IkOptions {
    fn default() -> Self {
        Self {
            position_tolerance: 1e-7,
            rotation_tolerance: 1e-7,
            attempts: 200,
            preference: Preference::default(),
        }
    }
}

/// Joint angles that give a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution<const N: usize> {
    /// Radians, within the limits.
    pub angles: SVector<f64, N>,
    /// Starts that were needed; 1 when the seed led there.
    pub attempts: usize,
    /// Yoshikawa's manipulability, the root of det(J Jᵀ); 0 at a singularity (m³).
    pub manipulability: f64,
}

/// Where an attempt ended.
struct Attempt<const N: usize> {
    angles: SVector<f64, N>,
    /// Metres and radians.
    error: [f64; 2],
}

impl<const N: usize> Chain<N> {
    /// Angles for the pose `base_from_tip`, as near to `seed` as its branch allows.
    ///
    /// # Errors
    /// Numbers that are not finite; a seed outside the limits; no solution, with how far the best attempt is away.
    pub fn solve(
        &self,
        base_from_tip: &RigidTransform,
        seed: &SVector<f64, N>,
        options: &IkOptions,
    ) -> Result<Solution<N>, KinematicsError> {
        self.require_limits(seed)?;
        let target = isometry(base_from_tip);
        let numbers = target.translation.vector.iter().chain(target.rotation.coords.iter());
        if !numbers.copied().all(f64::is_finite) {
            return Err(KinematicsError::PoseNotFinite);
        }
        let first = self.attempt(&target, *seed, options);
        if options.is_met(&first.error) {
            return Ok(self.finish(&target, &first.angles, seed, options, 1));
        }
        self.solve_from_anywhere(&target, seed, options, first)
    }

    fn solve_from_anywhere(
        &self,
        target: &Isometry3<f64>,
        seed: &SVector<f64, N>,
        options: &IkOptions,
        first: Attempt<N>,
    ) -> Result<Solution<N>, KinematicsError> {
        let mut random = fastrand::Rng::with_seed(RANDOM_SEED);
        let (mut best, mut found, mut needed) = (first, Vec::with_capacity(BRANCHES), 1);
        for attempt in 2..=options.attempts {
            let start = self.random_angles(&mut random);
            let end = self.attempt(target, start, options);
            if options.is_met(&end.error) {
                found.push(self.unwound(&end.angles, seed));
                needed = attempt;
            } else if end.error.iter().sum::<f64>() < best.error.iter().sum() {
                best = end;
            }
            if found.len() == BRANCHES {
                break;
            }
        }
        let distance = |angles: &SVector<f64, N>| (angles - seed).norm_squared();
        let nearest = found.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest
            .map(|angles| self.finish(target, &angles, seed, options, needed))
            .ok_or(KinematicsError::Unreachable {
                attempts: options.attempts.max(1),
                position_mm: 1e3 * best.error[0],
                rotation_deg: best.error[1].to_degrees(),
            })
    }

    fn random_angles(&self, random: &mut fastrand::Rng) -> SVector<f64, N> {
        SVector::from_fn(|joint, _| {
            let limits = self.joints()[joint].limits;
            limits.lower + random.f64() * (limits.upper - limits.lower)
        })
    }

    fn attempt(&self, target: &Isometry3<f64>, start: SVector<f64, N>, options: &IkOptions) -> Attempt<N> {
        let mut angles = start;
        let (mut least, mut since) = (f64::INFINITY, 0);
        for _ in 0..MOST_STEPS {
            let (tip, jacobian) = self.tip_and_jacobian(&angles);
            let error = pose_error(target, &tip);
            let sizes = sizes(&error);
            if options.is_met(&sizes) {
                return Attempt { angles, error: sizes };
            }
            let square = error.norm_squared();
            if square < 0.5 * least {
                (least, since) = (square, 0);
            }
            since += 1;
            if since > PATIENCE {
                break;
            }
            angles = self.step(&angles, jacobian, &error);
        }
        let (tip, _) = self.tip_and_jacobian(&angles);
        Attempt {
            angles,
            error: sizes(&pose_error(target, &tip)),
        }
    }

    /// One damped step within the limits. A joint that would leave them is taken out and the rest solved again.
    fn step(&self, angles: &SVector<f64, N>, mut jacobian: Jacobian<N>, error: &SVector<f64, 6>) -> SVector<f64, N> {
        let damping = DAMPING[0] + DAMPING[1] * error.norm_squared();
        let mut wanted = *angles;
        for _ in 0..3 {
            let Some(step) = damped(&jacobian, error, damping) else {
                break;
            };
            let longest = step.amax().max(LONGEST_STEP);
            wanted = angles + step * (LONGEST_STEP / longest);
            let mut is_inside = true;
            for (joint, known) in self.joints().iter().enumerate() {
                let is_out = !known.limits.contains(wanted[joint]);
                if is_out && jacobian.column(joint).amax() > 0.0 {
                    jacobian.column_mut(joint).fill(0.0);
                    is_inside = false;
                }
            }
            if is_inside {
                break;
            }
        }
        self.clamped(&wanted)
    }

    /// Moves a solution along its redundancy and unwinds it.
    fn finish(
        &self,
        target: &Isometry3<f64>,
        solution: &SVector<f64, N>,
        seed: &SVector<f64, N>,
        options: &IkOptions,
        attempts: usize,
    ) -> Solution<N> {
        let mut angles = self.unwound(solution, seed);
        for _ in 0..POLISH {
            let Some(moved) = options.preference.step(self, &angles, seed) else {
                break;
            };
            let end = self.attempt(target, self.clamped(&moved), options);
            if !options.is_met(&end.error) {
                break;
            }
            angles = end.angles;
        }
        Solution {
            angles,
            attempts,
            manipulability: manipulability(&self.tip_and_jacobian(&angles).1),
        }
    }
}

impl IkOptions {
    fn is_met(&self, error: &[f64; 2]) -> bool {
        error[0] <= self.position_tolerance && error[1] <= self.rotation_tolerance
    }
}

/// From the tip to the target: metres, then the rotation vector in radians, base axes.
fn pose_error(target: &Isometry3<f64>, tip: &Isometry3<f64>) -> SVector<f64, 6> {
    let position = target.translation.vector - tip.translation.vector;
    let rotation = (target.rotation * tip.rotation.inverse()).scaled_axis();
    let mut error = SVector::<f64, 6>::zeros();
    error.fixed_rows_mut::<3>(0).copy_from(&position);
    error.fixed_rows_mut::<3>(3).copy_from(&rotation);
    error
}

fn sizes(error: &SVector<f64, 6>) -> [f64; 2] {
    [error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm()]
}

/// `Jᵀ (J Jᵀ + λ)⁻¹ e`.
pub(crate) fn damped<const N: usize>(
    jacobian: &Jacobian<N>,
    error: &SVector<f64, 6>,
    damping: f64,
) -> Option<SVector<f64, N>> {
    let square = jacobian * jacobian.transpose() + SMatrix::<f64, 6, 6>::identity() * damping;
    Some(jacobian.transpose() * square.cholesky()?.solve(error))
}

/// Root of det(J Jᵀ) (Yoshikawa, "Manipulability of robotic mechanisms", IJRR 4(2), 1985).
pub(crate) fn manipulability<const N: usize>(jacobian: &Jacobian<N>) -> f64 {
    (jacobian * jacobian.transpose()).determinant().max(0.0).sqrt()
}
