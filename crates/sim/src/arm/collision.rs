//! Whether the arm touches itself: its links and its gripper as one capsule each.

use geometry::RigidTransform;
use geometry::nalgebra::{Point3, Vector3};

/// A capsule in its link's frame, metres. The radii are those of the tubes and housings, not of the capsules that hold the
/// whole shape: what is reported here touches in truth.
struct Capsule {
    ends: [[f64; 3]; 2],
    radius: f64,
}

const fn capsule(a: [f64; 3], b: [f64; 3], radius: f64) -> Capsule {
    Capsule { ends: [a, b], radius }
}

/// Base, links 1 to 7, vacuum gripper.
const CAPSULES: [Capsule; 9] = [
    capsule([0.0, 0.0, 0.089], [-0.013, 0.003, 0.030], 0.063),
    capsule([0.0, 0.0, -0.054], [0.0, 0.017, 0.0], 0.048),
    capsule([0.0, -0.032, 0.081], [0.0, -0.140, 0.019], 0.048),
    capsule([0.008, 0.001, -0.044], [0.051, -0.004, 0.0], 0.048),
    capsule([0.027, -0.016, 0.078], [0.087, -0.120, 0.011], 0.045),
    capsule([-0.001, 0.009, -0.153], [0.0, 0.046, 0.0], 0.042),
    capsule([0.076, 0.021, 0.0], [0.018, 0.005, 0.018], 0.042),
    capsule([0.0, 0.0, -0.014], [0.0, -0.013, -0.014], 0.037),
    capsule([0.0, 0.0, 0.028], [0.0, 0.0, 0.100], 0.038),
];

/// Pairs that can touch; the others are neighbours or never meet.
const PAIRS: [[usize; 2]; 14] = [
    [0, 4],
    [0, 5],
    [0, 6],
    [0, 7],
    [0, 8],
    [1, 5],
    [1, 6],
    [1, 7],
    [1, 8],
    [2, 5],
    [2, 6],
    [2, 7],
    [2, 8],
    [4, 8],
];

/// For the links' frames in the base.
pub(super) fn touches_itself(links: &[RigidTransform; 7]) -> bool {
    let segments: [[Point3<f64>; 2]; 9] = std::array::from_fn(|part| {
        let ends = CAPSULES[part].ends.map(Point3::from);
        match part {
            0 => ends,
            _ => ends.map(|end| links[(part - 1).min(6)].transform_point(&end)),
        }
    });
    PAIRS.iter().any(|[a, b]| {
        let near = CAPSULES[*a].radius + CAPSULES[*b].radius;
        squared_distance(&segments[*a], &segments[*b]) < near * near
    })
}

/// Of two segments (Ericson, "Real-Time Collision Detection", 2005, section 5.1.9).
fn squared_distance(first: &[Point3<f64>; 2], second: &[Point3<f64>; 2]) -> f64 {
    let (along, across) = (first[1] - first[0], second[1] - second[0]);
    let between: Vector3<f64> = first[0] - second[0];
    let (along_squared, across_squared) = (along.norm_squared(), across.norm_squared());
    let (mixed, along_between, across_between) = (along.dot(&across), along.dot(&between), across.dot(&between));
    let on_first = |share: f64| (share / along_squared).clamp(0.0, 1.0);
    let parallel = along_squared * across_squared - mixed * mixed;
    let free = if parallel > 1e-12 {
        ((mixed * across_between - along_between * across_squared) / parallel).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let (s, t) = match (mixed * free + across_between) / across_squared {
        before if before < 0.0 => (on_first(-along_between), 0.0),
        behind if behind > 1.0 => (on_first(mixed - along_between), 1.0),
        within => (free, within),
    };
    ((first[0] + along * s) - (second[0] + across * t)).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::config::ArmConfig;
    use crate::arm::model::ArmModel;

    fn touches(angles: [f64; 7]) -> bool {
        let model = ArmModel::new(&ArmConfig::default()).expect("the nominal arm");
        touches_itself(&model.links(&angles))
    }

    #[test]
    fn usual_places_are_free_and_folded_ones_are_not() {
        assert!(!touches([0.0; 7]));
        assert!(!touches([0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]));
        assert!(!touches([0.5, -0.6, 0.3, 1.2, -0.4, 1.6, 0.9]));
        // Folded, with the gripper into the base; with the gripper into the upper arm.
        assert!(touches([0.0, -0.4, 0.0, -0.1, 0.0, 1.1, 0.0]));
        assert!(touches([0.0, -0.4, 0.0, 0.3, 0.0, 2.6, 0.0]));
    }

    #[test]
    fn distances_of_segments() {
        let segment = |a: [f64; 3], b: [f64; 3]| [Point3::from(a), Point3::from(b)];
        let first = segment([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
        for (second, distance) in [
            (segment([0.5, -1.0, 2.0], [0.5, 1.0, 2.0]), 4.0),
            (segment([2.0, 0.0, 0.0], [3.0, 0.0, 0.0]), 1.0),
            (segment([-1.0, 1.0, 0.0], [2.0, 1.0, 0.0]), 1.0),
        ] {
            assert!((squared_distance(&first, &second) - distance).abs() < 1e-12);
        }
    }
}
