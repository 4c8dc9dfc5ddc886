//! Chains from URDF files.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use urdf_rs::{JointType, Robot};

use crate::chain::{Chain, Joint, Limits};
use crate::error::KinematicsError;

/// Links of a file; a longer way has a loop.
const MOST_LINKS: usize = 1000;

impl<const N: usize> Chain<N> {
    /// The way from `base` to `tip`; exactly `N` joints on it turn, the others are fixed.
    ///
    /// # Errors
    /// No such link, no way between them, joints that slide, limits or axes that cannot be, another number of joints.
    pub fn from_urdf(robot: &Robot, base: &str, tip: &str) -> Result<Self, KinematicsError> {
        let mut joints = Vec::new();
        let mut pending = Isometry3::identity();
        for joint in way(robot, base, tip)? {
            pending *= origin(joint)?;
            let limits = match joint.joint_type {
                JointType::Fixed => continue,
                JointType::Revolute => limits(joint)?,
                JointType::Continuous => endless(joint)?,
                _ => {
                    return Err(KinematicsError::JointKind {
                        joint: joint.name.clone(),
                        kind: format!("{:?}", joint.joint_type).to_lowercase(),
                    });
                }
            };
            joints.push(Joint {
                name: joint.name.clone(),
                limits,
                origin: std::mem::replace(&mut pending, Isometry3::identity()),
                axis: axis(joint)?,
            });
        }
        let found = joints.len();
        let joints = <[Joint; N]>::try_from(joints).map_err(|_| KinematicsError::JointCount {
            base: base.to_owned(),
            tip: tip.to_owned(),
            found,
            expected: N,
        })?;
        Ok(Self::new(joints, pending))
    }
}

/// Joints from the base down to the tip.
fn way<'a>(robot: &'a Robot, base: &str, tip: &str) -> Result<Vec<&'a urdf_rs::Joint>, KinematicsError> {
    for link in [base, tip] {
        if robot.links.iter().all(|known| known.name != link) {
            return Err(KinematicsError::NoLink { link: link.to_owned() });
        }
    }
    let (mut link, mut up) = (tip, Vec::new());
    while link != base {
        let above = robot.joints.iter().find(|joint| joint.child.link == link);
        let Some(joint) = above.filter(|_| up.len() < MOST_LINKS) else {
            return Err(KinematicsError::NotConnected {
                base: base.to_owned(),
                tip: tip.to_owned(),
                root: link.to_owned(),
            });
        };
        up.push(joint);
        link = &joint.parent.link;
    }
    up.reverse();
    Ok(up)
}

fn origin(joint: &urdf_rs::Joint) -> Result<Isometry3<f64>, KinematicsError> {
    let ([x, y, z], [roll, pitch, yaw]) = (joint.origin.xyz.0, joint.origin.rpy.0);
    for value in [x, y, z, roll, pitch, yaw] {
        require(joint, "origin", value, value.is_finite(), "finite numbers")?;
    }
    let rotation = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

fn axis(joint: &urdf_rs::Joint) -> Result<Unit<Vector3<f64>>, KinematicsError> {
    let vector = Vector3::from(joint.axis.xyz.0);
    let length = vector.norm();
    require(
        joint,
        "length of the axis",
        length,
        length > 1e-6 && length.is_finite(),
        "more than 0",
    )?;
    Ok(Unit::new_normalize(vector))
}

fn limits(joint: &urdf_rs::Joint) -> Result<Limits, KinematicsError> {
    let limit = &joint.limit;
    require(
        joint,
        "lower limit",
        limit.lower,
        limit.lower.is_finite(),
        "a finite number",
    )?;
    let is_above = limit.upper.is_finite() && limit.upper > limit.lower;
    require(
        joint,
        "upper limit",
        limit.upper,
        is_above,
        "finite and above the lower limit",
    )?;
    with_range(joint, limit.lower, limit.upper)
}

/// A joint without end is given ten turns either way: no cable has more.
fn endless(joint: &urdf_rs::Joint) -> Result<Limits, KinematicsError> {
    let most = 10.0 * std::f64::consts::TAU;
    with_range(joint, -most, most)
}

fn with_range(joint: &urdf_rs::Joint, lower: f64, upper: f64) -> Result<Limits, KinematicsError> {
    let (velocity, effort) = (joint.limit.velocity, joint.limit.effort);
    require(joint, "velocity limit", velocity, velocity > 0.0, "more than 0 rad/s")?;
    require(joint, "effort limit", effort, effort >= 0.0, "0 or more")?;
    Ok(Limits {
        lower,
        upper,
        velocity,
        effort,
    })
}

fn require(
    joint: &urdf_rs::Joint,
    what: &'static str,
    value: f64,
    is_allowed: bool,
    allowed: &'static str,
) -> Result<(), KinematicsError> {
    if is_allowed {
        return Ok(());
    }
    Err(KinematicsError::JointNumber {
        joint: joint.name.clone(),
        what,
        value,
        allowed,
    })
}
