//! Transforms as TF messages carry them.

use geometry::RigidTransform;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::geometry_msgs::msg::{Quaternion, Transform, TransformStamped, Vector3};
use interfaces::std_msgs::msg::Header;

use super::error::TfError;

/// Where a frame is, relative to its parent, at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct StampedTransform {
    /// The frame that it hangs on (`header.frame_id`).
    pub parent: String,
    /// The frame (`child_frame_id`).
    pub child: String,
    /// Nanoseconds; of no meaning for static transforms.
    pub stamp: i64,
    /// Child coordinates to parent coordinates, metres.
    pub parent_from_child: RigidTransform,
}

impl StampedTransform {
    /// `parent_from_child` at `stamp` nanoseconds.
    pub fn new(parent: &str, child: &str, stamp: i64, parent_from_child: RigidTransform) -> Self {
        Self {
            parent: parent.into(),
            child: child.into(),
            stamp,
            parent_from_child,
        }
    }

    /// From a message; refuses what is no rigid transform.
    pub fn from_message(message: &TransformStamped) -> Result<Self, TfError> {
        // Older nodes write a slash in front; REP 105's frame ids have none.
        let (parent, child) = (
            message.header.frame_id.trim_start_matches('/'),
            message.child_frame_id.trim_start_matches('/'),
        );
        let Transform {
            translation: Vector3 { x, y, z },
            rotation,
        } = &message.transform;
        let xyzw = [rotation.x, rotation.y, rotation.z, rotation.w];
        let parent_from_child =
            RigidTransform::from_quaternion_xyzw([*x, *y, *z], xyzw).map_err(|problem| TfError::Invalid {
                child: child.into(),
                parent: parent.into(),
                problem: Box::new(problem),
            })?;
        Ok(Self::new(
            parent,
            child,
            message.header.stamp.to_nanos(),
            parent_from_child,
        ))
    }

    /// As a message.
    pub fn to_message(&self) -> TransformStamped {
        let [x, y, z] = self.parent_from_child.translation().into();
        let [qx, qy, qz, qw] = self.parent_from_child.quaternion_xyzw();
        TransformStamped {
            header: Header {
                stamp: Time::from_nanos(self.stamp).unwrap_or_default(),
                frame_id: self.parent.clone(),
            },
            child_frame_id: self.child.clone(),
            transform: Transform {
                translation: Vector3 { x, y, z },
                rotation: Quaternion {
                    x: qx,
                    y: qy,
                    z: qz,
                    w: qw,
                },
            },
        }
    }
}
