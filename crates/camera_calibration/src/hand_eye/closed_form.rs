//! `A X = X B` without iteration.
//!
//! Park and Martin 1994, "Robot sensor calibration: solving AX = XB on the Euclidean group", IEEE T-RA 10(5): with `α` and
//! `β` the rotation vectors of `A` and `B`, `R_X` turns every `β` into its `α` (section III, solved here by singular
//! values, which gives a rotation for any input); then `(R_A - 1) t_X = R_X t_B - t_A` is linear.

use geometry::RigidTransform;
use nalgebra::{Matrix3, Vector3};

use crate::homography::{nearest_rotation, sorted_eigen};

/// A pose of the arm's chain and one of the camera's: `A_ij = arm_i⁻¹ arm_j`, `B_ij = eye_i⁻¹ eye_j`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    pub(crate) arm: RigidTransform,
    pub(crate) eye: RigidTransform,
    /// Only stations of the same group belong together.
    pub(crate) group: usize,
}

/// All pairs of stations of a group, as `(A, B)`.
fn motions(stations: &[Station]) -> Vec<(RigidTransform, RigidTransform)> {
    let pair = |a: &Station, b: &Station| (a.arm.inverse() * b.arm, a.eye.inverse() * b.eye);
    let mut found = Vec::new();
    for (i, a) in stations.iter().enumerate() {
        found.extend(stations[..i].iter().filter(|b| a.group == b.group).map(|b| pair(a, b)));
    }
    found
}

/// The furthest turn of the arm about the second of its main axes, radians: zero when it only turned about one.
pub(crate) fn second_turn(stations: &[Station]) -> f64 {
    let turns: Vec<Vector3<f64>> = motions(stations)
        .iter()
        .map(|(a, _)| a.rotation().scaled_axis())
        .collect();
    let spread: Matrix3<f64> = turns.iter().map(|turn| turn * turn.transpose()).sum();
    let (_, axes) = sorted_eigen(&spread);
    let axis = axes.column(1).into_owned();
    turns.iter().map(|turn| turn.dot(&axis).abs()).fold(0.0, f64::max)
}

/// `X`; none when the motions do not determine it.
pub(crate) fn park_martin(stations: &[Station]) -> Option<RigidTransform> {
    let motions = motions(stations);
    let outer =
        |(a, b): &(RigidTransform, RigidTransform)| a.rotation().scaled_axis() * b.rotation().scaled_axis().transpose();
    let rotation = nearest_rotation(&motions.iter().map(outer).sum())?;
    let (mut square, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (a, b) in &motions {
        let turn = a.rotation_matrix() - Matrix3::identity();
        square += turn.transpose() * turn;
        right += turn.transpose() * (rotation * b.translation() - a.translation());
    }
    let translation = square.cholesky()?.solve(&right);
    Some(RigidTransform::from_parts(translation, rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn pose(turn: [f64; 3], shift: [f64; 3]) -> RigidTransform {
        RigidTransform::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn.into()))
    }

    #[test]
    fn exact_motions_give_the_exact_pose_whatever_it_is() {
        let mut random = fastrand::Rng::with_seed(5);
        for _ in 0..50 {
            let mut any = |size: f64| [0; 3].map(|_| size * (2.0 * random.f64() - 1.0));
            let (truth, end) = (pose(any(1.8), any(0.2)), pose(any(1.8), any(0.6)));
            let station = |arm: RigidTransform| Station {
                arm,
                // arm X eye⁻¹ is the same for all.
                eye: end.inverse() * arm * truth,
                group: 0,
            };
            let stations: Vec<Station> = (0..4).map(|_| station(pose(any(1.0), any(0.5)))).collect();
            let found = park_martin(&stations).unwrap();
            assert!(
                (found.translation() - truth.translation()).norm() < 1e-9,
                "{found:?} {truth:?}"
            );
            assert!(found.rotation().angle_to(&truth.rotation()) < 1e-7);
            assert!(second_turn(&stations) > 0.05);
        }
    }

    #[test]
    fn turns_about_one_axis_leave_the_second_at_zero() {
        let turn = |angle: f64| Station {
            arm: pose([0.0, angle, 0.0], [angle, 0.1, 0.2]),
            eye: pose([angle, 0.0, 0.0], [0.1, 0.0, 0.0]),
            group: 0,
        };
        assert!(second_turn(&[turn(0.0), turn(0.4), turn(0.9)]) < 1e-6);
    }
}
