//! The chain and its forward kinematics.

use geometry::RigidTransform;
use nalgebra::{Isometry3, SMatrix, SVector, Unit, UnitQuaternion, Vector3};

use crate::error::KinematicsError;

/// Columns: joints. Rows: the tip's velocity (m/s for 1 rad/s), then its angular velocity (rad/s); both in the axes of
/// the chain's base.
pub type Jacobian<const N: usize> = SMatrix<f64, 6, N>;

/// What a joint can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Smallest angle, radians.
    pub lower: f64,
    /// Largest angle, radians.
    pub upper: f64,
    /// Largest speed, rad/s.
    pub velocity: f64,
    /// Largest torque, newton metres.
    pub effort: f64,
}

/// A joint that turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// As in the URDF.
    pub name: String,
    /// What it can do.
    pub limits: Limits,
    /// Its frame in that of the joint before (or the chain's base), at angle 0.
    pub(crate) origin: Isometry3<f64>,
    /// What it turns about; its own frame.
    pub(crate) axis: Unit<Vector3<f64>>,
}

/// The way from a base link to a tip over `N` joints that turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain<const N: usize> {
    joints: [Joint; N],
    /// The tip in the last joint's frame.
    last_from_tip: Isometry3<f64>,
}

impl Joint {
    /// What it turns about, in its own frame.
    pub fn axis(&self) -> Unit<Vector3<f64>> {
        self.axis
    }
}

impl<const N: usize> Chain<N> {
    pub(crate) fn new(joints: [Joint; N], last_from_tip: Isometry3<f64>) -> Self {
        Self { joints, last_from_tip }
    }

    /// From the base on.
    pub fn joints(&self) -> &[Joint; N] {
        &self.joints
    }

    /// The same joints, with a frame at the tip that is fixed to it: a tool.
    #[must_use]
    pub fn with_tool(mut self, tip_from_tool: &RigidTransform) -> Self {
        self.last_from_tip *= isometry(tip_from_tool);
        self
    }

    pub(crate) fn with_origins(mut self, origins: [Isometry3<f64>; N]) -> Self {
        for (joint, origin) in self.joints.iter_mut().zip(origins) {
            joint.origin = origin;
            joint.axis = Vector3::z_axis();
        }
        self
    }

    /// `base_from_tip` at joint angles (radians), within limits or not.
    pub fn forward(&self, angles: &SVector<f64, N>) -> Result<RigidTransform, KinematicsError> {
        self.require_finite(angles)?;
        let (_, tip) = self.frames(angles);
        Ok(RigidTransform::from_parts(tip.translation.vector, tip.rotation))
    }

    /// `base_from_joint` of every joint, turned by its angle (radians): the frames of the links that follow them.
    pub fn joint_frames(&self, angles: &SVector<f64, N>) -> Result<[RigidTransform; N], KinematicsError> {
        self.require_finite(angles)?;
        let (frames, _) = self.frames(angles);
        Ok(frames.map(|frame| RigidTransform::from_parts(frame.translation.vector, frame.rotation)))
    }

    /// Pose of the tip and [`Jacobian`] at joint angles (radians).
    pub fn jacobian(&self, angles: &SVector<f64, N>) -> Result<(RigidTransform, Jacobian<N>), KinematicsError> {
        self.require_finite(angles)?;
        let (tip, jacobian) = self.tip_and_jacobian(angles);
        Ok((
            RigidTransform::from_parts(tip.translation.vector, tip.rotation),
            jacobian,
        ))
    }

    pub(crate) fn tip_and_jacobian(&self, angles: &SVector<f64, N>) -> (Isometry3<f64>, Jacobian<N>) {
        let (frames, tip) = self.frames(angles);
        let mut jacobian = Jacobian::<N>::zeros();
        for (column, (joint, frame)) in self.joints.iter().zip(&frames).enumerate() {
            let axis = frame.rotation * joint.axis.into_inner();
            let arm = tip.translation.vector - frame.translation.vector;
            jacobian.fixed_view_mut::<3, 1>(0, column).copy_from(&axis.cross(&arm));
            jacobian.fixed_view_mut::<3, 1>(3, column).copy_from(&axis);
        }
        (tip, jacobian)
    }

    /// Of the joints, turned, and of the tip.
    pub(crate) fn frames(&self, angles: &SVector<f64, N>) -> ([Isometry3<f64>; N], Isometry3<f64>) {
        let mut frames = [Isometry3::identity(); N];
        let mut parent = Isometry3::identity();
        for ((frame, joint), angle) in frames.iter_mut().zip(&self.joints).zip(angles.iter()) {
            let turned = UnitQuaternion::from_axis_angle(&joint.axis, *angle);
            *frame = parent * joint.origin * turned;
            parent = *frame;
        }
        (frames, parent * self.last_from_tip)
    }
}

pub(crate) fn isometry(transform: &RigidTransform) -> Isometry3<f64> {
    Isometry3::from_parts(transform.translation().into(), transform.rotation())
}
