//! The arm's frames on TF.

use std::collections::BTreeSet;

use devices::JointValues;
use geometry::RigidTransform;
use kinematics::Chain;
use nalgebra::{SVector, UnitQuaternion, Vector3};
use ros::tf::StampedTransform;
use urdf_rs::{Joint, JointType, Robot};

/// Joints of the description, sorted by what moves them.
pub(crate) struct Frames {
    base: String,
    /// Links behind the joints that turn, from the base on.
    turned: Vec<String>,
    fixed: Vec<StampedTransform>,
}

impl Frames {
    /// `others` are frames that somebody else tells.
    pub(crate) fn of(robot: &Robot, base: &str, others: &[String]) -> Self {
        let is_fixed = |joint: &&Joint| joint.joint_type == JointType::Fixed;
        let is_ours = |joint: &&Joint| !others.contains(&joint.child.link);
        Self {
            base: base.to_owned(),
            turned: chain_of_links(robot, base),
            fixed: robot
                .joints
                .iter()
                .filter(is_fixed)
                .filter(is_ours)
                .map(fixed)
                .collect(),
        }
    }

    pub(crate) fn fixed(&self) -> Vec<StampedTransform> {
        self.fixed.clone()
    }

    /// Each link in the one before; none when the angles are none.
    pub(crate) fn moving(&self, chain: &Chain<7>, angles: &JointValues, stamp: i64) -> Vec<StampedTransform> {
        let Ok(frames) = chain.joint_frames(&SVector::from(*angles)) else {
            return Vec::new();
        };
        let mut parent = (self.base.as_str(), RigidTransform::identity());
        let mut transforms = Vec::with_capacity(self.turned.len());
        for (link, base_from_link) in self.turned.iter().zip(frames) {
            let parent_from_link = parent.1.inverse() * base_from_link;
            transforms.push(StampedTransform::new(parent.0, link, stamp, parent_from_link));
            parent = (link, base_from_link);
        }
        transforms
    }
}

/// Links behind turning joints, followed from the base; a description that branches there is not one of an arm.
fn chain_of_links(robot: &Robot, base: &str) -> Vec<String> {
    let (mut parent, mut links, mut seen) = (base.to_owned(), Vec::new(), BTreeSet::new());
    let turns = |joint: &&Joint| matches!(joint.joint_type, JointType::Revolute | JointType::Continuous);
    while seen.insert(parent.clone()) {
        let Some(joint) = robot
            .joints
            .iter()
            .filter(turns)
            .find(|joint| joint.parent.link == parent)
        else {
            break;
        };
        parent.clone_from(&joint.child.link);
        links.push(parent.clone());
    }
    links
}

fn fixed(joint: &Joint) -> StampedTransform {
    let ([x, y, z], [roll, pitch, yaw]) = (joint.origin.xyz.0, joint.origin.rpy.0);
    let transform = RigidTransform::from_parts(
        Vector3::new(x, y, z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    );
    StampedTransform::new(&joint.parent.link, &joint.child.link, 0, transform)
}
