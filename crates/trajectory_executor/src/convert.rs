//! Between messages and what the algorithms take.

use geometry::RigidTransform;
use interfaces::builtin_interfaces::msg::Duration as DurationMessage;
use interfaces::geometry_msgs::msg::{Point, Pose, Quaternion};

use crate::error::MotionError;

pub(crate) fn duration_seconds(message: DurationMessage) -> f64 {
    f64::from(message.sec) + f64::from(message.nanosec) * 1e-9
}

pub(crate) fn pose_message(pose: &RigidTransform) -> Pose {
    let (at, [x, y, z, w]) = (pose.translation(), pose.quaternion_xyzw());
    Pose {
        position: Point {
            x: at.x,
            y: at.y,
            z: at.z,
        },
        orientation: Quaternion { x, y, z, w },
    }
}

/// `name` is for the error.
pub(crate) fn pose(name: &str, message: &Pose) -> Result<RigidTransform, MotionError> {
    let Pose { position, orientation } = message;
    let xyzw = [orientation.x, orientation.y, orientation.z, orientation.w];
    RigidTransform::from_quaternion_xyzw([position.x, position.y, position.z], xyzw)
        .map_err(|error| MotionError::Request(format!("{name}: {error}")))
}
