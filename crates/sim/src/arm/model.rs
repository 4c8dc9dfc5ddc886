//! The arm as a mechanism: where its links are, how far its joints go.

use geometry::RigidTransform;
use geometry::nalgebra::SVector;
use kinematics::{Chain, IkOptions, Jacobian, KinematicsError, ModifiedDh, Preference};
use xarm_protocol::JointRange;

use super::config::ArmConfig;
use super::error::ArmError;

/// The nominal arm.
const URDF: &str = include_str!("../../../../urdf/xarm7.urdf");
/// What single precision on the wire may add to an angle, radians.
const ROUNDING: f64 = 2e-6;
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

/// Angles, speeds or torques of the joints.
pub(super) type Joints = [f64; 7];

pub(super) struct ArmModel {
    chain: Chain<7>,
    dimensions: [ModifiedDh; 7],
}

impl ArmModel {
    pub(super) fn new(config: &ArmConfig) -> Result<Self, ArmError> {
        let mut robot = read_urdf()?;
        let ranges = config.identity.generation().joint_ranges();
        let moving = robot.joints.iter_mut().filter(|joint| joint.limit.velocity > 0.0);
        for (joint, range) in moving.zip(ranges) {
            (joint.limit.lower, joint.limit.upper) = (range.lower, range.upper);
        }
        let dimensions = config.calibration.unwrap_or_else(nominal_dimensions);
        let chain = Chain::from_urdf(&robot, "link_base", "link_eef")?.with_modified_dh(&dimensions)?;
        chain.require_limits(&config.joints.into())?;
        Ok(Self { chain, dimensions })
    }

    /// Modified Denavit-Hartenberg parameters.
    pub(super) fn dimensions(&self) -> &[ModifiedDh; 7] {
        &self.dimensions
    }

    /// `base_from_flange`.
    pub(super) fn flange(&self, angles: &Joints) -> RigidTransform {
        // Angles are finite: requests with others are refused.
        self.chain
            .forward(&(*angles).into())
            .unwrap_or_else(|_| RigidTransform::identity())
    }

    /// Links 1 to 7, base frame.
    pub(super) fn links(&self, angles: &Joints) -> [RigidTransform; 7] {
        self.chain
            .joint_frames(&(*angles).into())
            .unwrap_or([RigidTransform::identity(); 7])
    }

    /// Of a frame that is fixed to the flange.
    pub(super) fn jacobian(&self, angles: &Joints, flange_from_tool: &RigidTransform) -> Jacobian<7> {
        let chain = self.chain.clone().with_tool(flange_from_tool);
        chain
            .jacobian(&(*angles).into())
            .map_or_else(|_| Jacobian::zeros(), |(_, jacobian)| jacobian)
    }

    pub(super) fn range(&self, joint: usize) -> JointRange {
        let limits = self.chain.joints()[joint].limits;
        JointRange {
            lower: limits.lower,
            upper: limits.upper,
        }
    }

    pub(super) fn middle(&self, joint: usize) -> f64 {
        let range = self.range(joint);
        f64::midpoint(range.lower, range.upper)
    }

    /// The first joint that is outside its range, 0 for the first.
    pub(super) fn outside(&self, angles: &Joints) -> Option<usize> {
        (0..7).find(|joint| {
            let range = self.range(*joint);
            !(range.lower - ROUNDING..=range.upper + ROUNDING).contains(&angles[*joint])
        })
    }

    /// Angles for a pose of the flange on the same branch as `near`, for the next step of a path.
    pub(super) fn follow(&self, base_from_flange: &RigidTransform, near: &Joints) -> Result<Joints, KinematicsError> {
        self.solve(base_from_flange, near, 1)
    }

    /// Angles for a pose of the flange on any branch.
    pub(super) fn reach(&self, base_from_flange: &RigidTransform, near: &Joints) -> Result<Joints, KinematicsError> {
        self.solve(base_from_flange, near, 40)
    }

    fn solve(&self, pose: &RigidTransform, near: &Joints, attempts: usize) -> Result<Joints, KinematicsError> {
        let options = IkOptions {
            attempts,
            // A path must not wander along the redundancy.
            preference: Preference {
                nearness: 1.0,
                limits: 0.0,
                singularities: 0.0,
            },
            ..IkOptions::default()
        };
        let seed = SVector::from_fn(|joint, _| {
            let range = self.range(joint);
            near[joint].clamp(range.lower, range.upper)
        });
        Ok(self.chain.solve(pose, &seed, &options)?.angles.into())
    }
}

pub(super) fn read_urdf() -> Result<urdf_rs::Robot, ArmError> {
    urdf_rs::read_from_string(URDF).map_err(|error| ArmError::Urdf {
        reason: error.to_string(),
    })
}

fn nominal_dimensions() -> [ModifiedDh; 7] {
    let row = |alpha, a, d| ModifiedDh {
        theta: 0.0,
        d,
        alpha,
        a,
    };
    [
        row(0.0, 0.0, 0.267),
        row(-QUARTER, 0.0, 0.0),
        row(QUARTER, 0.0, 0.293),
        row(QUARTER, 0.0525, 0.0),
        row(QUARTER, 0.0775, 0.3425),
        row(QUARTER, 0.0, 0.0),
        row(-QUARTER, 0.076, 0.097),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nominal_dimensions_are_those_of_the_urdf() {
        let model = ArmModel::new(&ArmConfig::default()).expect("the nominal arm");
        let robot = urdf_rs::read_from_string(URDF).expect("a URDF");
        let chain: Chain<7> = Chain::from_urdf(&robot, "link_base", "link_eef").expect("a chain");
        let angles = [0.5, -0.6, 0.3, 1.2, -0.4, 1.6, 0.9];
        let (ours, theirs) = (
            model.flange(&angles),
            chain.forward(&angles.into()).expect("finite angles"),
        );
        assert!((ours.translation() - theirs.translation()).norm() < 1e-8);
        assert!(
            (ours.translation() * 1e3 - geometry::nalgebra::Vector3::new(201.0903, 214.2523, 614.8912)).norm() < 1e-3
        );
        assert!(ours.rotation().angle_to(&theirs.rotation()) < 1e-8);
    }
}
