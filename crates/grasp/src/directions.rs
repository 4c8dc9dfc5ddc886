//! Orientations the gripper can take.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::options::SearchOptions;

/// Normals nearer than this share of the step are one.
const SAME: f64 = 0.6;
/// Below the horizon by more than this no gripper comes, radians.
const LOWEST: f64 = 0.1;

/// Normals of surfaces that the gripper can meet head on: rings about each direction, none twice, none from below.
pub(crate) fn orientations(directions: &[Vector3<f64>], search: &SearchOptions) -> Vec<Vector3<f64>> {
    let mut found: Vec<Vector3<f64>> = Vec::new();
    let least = (SAME * search.step).cos();
    for direction in directions {
        for orientation in cone(direction, search) {
            let is_new = found.iter().all(|other| other.dot(&orientation) < least);
            if is_new && orientation.z >= -LOWEST.sin() {
                found.push(orientation);
            }
        }
    }
    found
}

/// Angle between a normal and the nearest direction, radians.
pub(crate) fn misalignment(normal: &Vector3<f64>, directions: &[Vector3<f64>]) -> f64 {
    let cosine = directions
        .iter()
        .map(|direction| direction.dot(normal))
        .fold(-1.0, f64::max);
    cosine.clamp(-1.0, 1.0).acos()
}

fn cone(axis: &Vector3<f64>, search: &SearchOptions) -> Vec<Vector3<f64>> {
    let [u, v] = across(axis);
    let rings = (search.cone / search.step + 1e-9).floor() as usize;
    let mut found = vec![*axis];
    for ring in 1..=rings {
        let polar = ring as f64 * search.step;
        let count = (TAU * polar.sin() / search.step).ceil().max(1.0) as usize;
        let turned = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
            axis * polar.cos() + (u * cos + v * sin) * polar.sin()
        };
        found.extend((0..count).map(turned));
    }
    found
}

/// Two unit vectors that complete a unit vector to a right-handed frame.
pub(crate) fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let helper = if axis.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let u = axis.cross(&helper).normalize();
    [u, axis.cross(&u)]
}
