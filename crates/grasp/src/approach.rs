//! How the tool comes to a grasp, and how it leaves with the object.

use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3};

use crate::result::Grasp;

/// How far the tool stays away before and goes after.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// From where the approach starts to the contact, along the normal; metres.
    pub pregrasp_distance: f64,
    /// How far up the object is lifted, along the base's z axis; metres.
    pub retreat_height: f64,
}

/// Poses of the tool, `base_from_tool`: its origin is the middle of the cup's lip, its z axis points out of the cup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// Where the approach starts.
    pub pregrasp: RigidTransform,
    /// At contact.
    pub grasp: RigidTransform,
    /// Where the object is lifted to.
    pub retreat: RigidTransform,
}

impl Grasp {
    /// The tool's way to this grasp. `base_from_held` is how the tool is held elsewhere: it is turned no further than the
    /// approach asks for, so that what is fixed beside the cup stays on its side, and then by `yaw` radians about its own
    /// z axis, about which a cup may be turned as one likes.
    pub fn approach(&self, base_from_held: &UnitQuaternion<f64>, yaw: f64, way: &Way) -> Approach {
        let rotation = turned_to(&self.approach_axis(), base_from_held, yaw);
        let at = |offset: Vector3<f64>| RigidTransform::from_parts(self.contact.coords + offset, rotation);
        Approach {
            pregrasp: at(self.normal * way.pregrasp_distance),
            grasp: at(Vector3::zeros()),
            retreat: at(Vector3::z() * way.retreat_height),
        }
    }
}

fn turned_to(axis: &Vector3<f64>, base_from_held: &UnitQuaternion<f64>, yaw: f64) -> UnitQuaternion<f64> {
    let held_axis = base_from_held * Vector3::z();
    // Opposite directions leave it open which way round to turn.
    let half_turn = || UnitQuaternion::from_axis_angle(&(base_from_held * Vector3::x_axis()), std::f64::consts::PI);
    let turn = UnitQuaternion::rotation_between(&held_axis, axis).unwrap_or_else(half_turn);
    turn * base_from_held * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn unit() -> impl Strategy<Value = Vector3<f64>> {
        let number = || -1.0..1.0_f64;
        let vector = (number(), number(), number()).prop_map(|(x, y, z)| Vector3::new(x, y, z));
        vector.prop_filter_map("a direction", |vector| vector.try_normalize(0.1))
    }

    proptest! {
        #[test]
        fn the_tool_points_along_the_approach_and_turns_no_further(axis in unit(), angles in unit(), yaw in -3.0..3.0_f64) {
            let held = UnitQuaternion::from_scaled_axis(angles * 3.0);
            let rotation = turned_to(&axis, &held, yaw);
            prop_assert!((rotation * Vector3::z() - axis).norm() < 1e-9);
            let least = (held * Vector3::z()).angle(&axis);
            prop_assert!((turned_to(&axis, &held, 0.0).angle_to(&held) - least).abs() < 1e-6);
            prop_assert!((turned_to(&axis, &held, 0.0).angle_to(&rotation) - yaw.abs()).abs() < 1e-6);
        }
    }

    #[test]
    fn the_opposite_direction_is_half_a_turn() {
        let rotation = turned_to(&-Vector3::z(), &UnitQuaternion::identity(), 0.0);
        assert!((rotation * Vector3::z() + Vector3::z()).norm() < 1e-9);
        assert!((rotation * Vector3::x() - Vector3::x()).norm() < 1e-9);
    }
}
