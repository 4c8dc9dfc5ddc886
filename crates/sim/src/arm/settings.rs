//! What clients may set and the controller keeps.

use geometry::RigidTransform;
use geometry::nalgebra::Vector3;

use super::dynamics::Load;
use super::velocity::Accelerations;

#[derive(Debug, Clone)]
pub(super) struct Settings {
    /// As on the wire, so that it is reported as it was set.
    pub(super) tcp_offset: [f32; 6],
    /// Kilograms, millimetres.
    pub(super) load: [f32; 4],
    pub(super) collision_sensitivity: u8,
    pub(super) teach_sensitivity: u8,
    pub(super) gravity: [f32; 3],
    pub(super) world_offset: [f32; 6],
    /// mm/s³ and mm/s².
    pub(super) tcp_jerk: f32,
    pub(super) tcp_acceleration: f32,
    /// rad/s³ and rad/s².
    pub(super) joint_jerk: f32,
    pub(super) joint_acceleration: f32,
    pub(super) checks_self_collision: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tcp_offset: [0.0; 6],
            load: [0.0; 4],
            collision_sensitivity: 3,
            teach_sensitivity: 3,
            gravity: [0.0, 0.0, -1.0],
            world_offset: [0.0; 6],
            tcp_jerk: 1000.0,
            tcp_acceleration: 50_000.0,
            joint_jerk: 20.0,
            joint_acceleration: 20.0,
            checks_self_collision: true,
        }
    }
}

/// Of the tool's rotation, rad/s².
const ROTATION: f64 = 20.0;

impl Settings {
    pub(super) fn flange_from_tool(&self) -> RigidTransform {
        super::units::pose_of_wire(&self.tcp_offset)
    }

    /// Of velocity modes.
    pub(super) fn accelerations(&self) -> Accelerations {
        Accelerations {
            joints: f64::from(self.joint_acceleration),
            tool: f64::from(self.tcp_acceleration) * 1e-3,
            rotation: ROTATION,
        }
    }

    pub(super) fn down(&self) -> Vector3<f64> {
        let [x, y, z] = self.gravity.map(f64::from);
        Vector3::new(x, y, z).try_normalize(1e-9).unwrap_or(-Vector3::z())
    }

    pub(super) fn mounted(&self) -> Load {
        let [mass, x, y, z] = self.load.map(f64::from);
        (mass, [x, y, z].map(|millimetres| millimetres * 1e-3))
    }
}
