//! Poses as a world file gives them.

use geometry::RigidTransform;
use geometry::nalgebra::UnitQuaternion;
use serde::Deserialize;

use crate::SimError;

/// Metres and radians; what is not given is the default's place, and no rotation.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct PoseFile {
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
    /// About x, then pitch about y, then yaw about z, axes fixed: as in a URDF.
    roll: Option<f64>,
    pitch: Option<f64>,
    yaw: Option<f64>,
    quaternion: Option<[f64; 4]>,
}

impl PoseFile {
    pub(super) fn resolve(&self, default_place: [f64; 3]) -> Result<RigidTransform, SimError> {
        let translation = [
            self.x.unwrap_or(default_place[0]),
            self.y.unwrap_or(default_place[1]),
            self.z.unwrap_or(default_place[2]),
        ];
        let angles = [self.roll, self.pitch, self.yaw];
        match self.quaternion {
            Some(_) if angles.iter().any(Option::is_some) => Err(SimError::value(
                "quaternion",
                "given beside roll, pitch or yaw",
                "one of both",
            )),
            Some(quaternion) => Ok(RigidTransform::from_quaternion_xyzw(translation, quaternion)?),
            None => from_angles(translation, angles.map(Option::unwrap_or_default)),
        }
    }
}

fn from_angles(translation: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Result<RigidTransform, SimError> {
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    let [x, y, z, w] = [rotation.i, rotation.j, rotation.k, rotation.w];
    // Refuses what is not finite.
    Ok(RigidTransform::from_quaternion_xyzw(translation, [x, y, z, w])?)
}
