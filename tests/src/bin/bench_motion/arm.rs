//! The arm, and random places for it.

use std::path::{Path, PathBuf};

use devices::JointValues;
use fastrand::Rng;
use kinematics::Chain;
use trajectory::{Planner, TrajectoryError, TrajectoryLimits};
use trajectory_executor::servo::ServoConfig;
use urdf_rs::Robot;

pub(crate) const HOME: JointValues = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
/// Of joints in motions: what the node of the arm has by default, rad/s² and rad/s³.
const ACCELERATION: f64 = 10.0;
const JERK: f64 = 200.0;
/// Of the tool in motions, m/s: the node's default, and its most.
pub(crate) const TOOL_SPEEDS: [f64; 2] = [0.25, 0.95];
/// What the servo loop's last gate allows, as in the node, m/s.
const MOST_TOOL_SPEED: f64 = 0.99;

pub(crate) struct Arm {
    pub(crate) robot: Robot,
    pub(crate) chain: Chain<7>,
}

/// A file of the folder `urdf/`.
pub(crate) fn urdf(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../urdf").join(file)
}

impl Arm {
    pub(crate) fn load() -> anyhow::Result<Self> {
        let robot = urdf_rs::read_file(urdf("xarm7.urdf"))?;
        let chain = Chain::from_urdf(&robot, "link_base", "link_tcp")?;
        Ok(Self { robot, chain })
    }

    pub(crate) fn limits(&self, tool_speed: f64) -> Result<TrajectoryLimits<7>, TrajectoryError> {
        TrajectoryLimits::of_chain(&self.chain, ACCELERATION, JERK, tool_speed)
    }

    pub(crate) fn planner(&self, tool_speed: f64) -> Result<Planner<7>, TrajectoryError> {
        Planner::new(self.chain.clone(), self.limits(tool_speed)?)
    }

    /// For an arm that rests at `start`.
    pub(crate) fn servo(&self, start: &JointValues) -> Result<ServoConfig, TrajectoryError> {
        ServoConfig::within(self.chain.clone(), &self.limits(MOST_TOOL_SPEED)?, start)
    }

    /// Anywhere within the joints' limits.
    pub(crate) fn anywhere(&self, random: &mut Rng) -> JointValues {
        self.chain.joints().each_ref().map(|joint| {
            let limits = joint.limits;
            limits.lower + random.f64() * (limits.upper - limits.lower)
        })
    }
}
