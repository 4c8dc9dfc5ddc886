//! The `bin:` of a world file.

use geometry::RigidTransform;
use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::file::within;
use crate::SimError;

/// Metres: further away or larger is no bin of this cell.
const FAR: f64 = 10.0;

/// Where the cup drops what it picked: open at its top, square inside, on the table. Metres and radians, base frame. As in
/// `urdf/cell.urdf` unless the file says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bin {
    /// Of its middle.
    pub x: f64,
    /// Of its middle.
    pub y: f64,
    /// How far it is turned.
    pub yaw: f64,
    /// From one wall to the opposite one, inside.
    pub size: f64,
    /// Of its walls, above the table.
    pub height: f64,
}

impl Default for Bin {
    fn default() -> Self {
        Self {
            x: 0.18,
            y: 0.36,
            yaw: 0.0,
            size: 0.18,
            height: 0.06,
        }
    }
}

impl Bin {
    /// Upper side of the floor above the table, metres.
    pub const FLOOR: f64 = 0.003;
    /// Thickness of the walls, metres.
    pub const WALL: f64 = 0.003;

    pub(super) fn checked(self) -> Result<Self, SimError> {
        within("x", self.x, -FAR, FAR)?;
        within("y", self.y, -FAR, FAR)?;
        within("yaw", self.yaw, -100.0, 100.0)?;
        within("size", self.size, 0.01, FAR)?;
        within("height", self.height, 0.004, FAR)?;
        Ok(self)
    }

    /// Middle of the floor's upper side, z up.
    pub fn base_from_bin(&self) -> RigidTransform {
        RigidTransform::from_parts(
            Vector3::new(self.x, self.y, Self::FLOOR),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw),
        )
    }

    /// Whether a point, base frame, is over or in the inner square.
    pub fn holds(&self, point: &Point3<f64>) -> bool {
        let point = self.base_from_bin().inverse().transform_point(point);
        point.x.abs() < self.size / 2.0 && point.y.abs() < self.size / 2.0
    }
}
