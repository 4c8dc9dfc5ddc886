//! The arm and what stands around it: what motions are planned with and checked against.

use collision::{ArmModel, Checker, Scene, SelfCollision, XARM7_NEVER_TOUCHING};
use devices::JointValues;
use kinematics::{Chain, ModifiedDh};
use trajectory::{Planner, Trajectory, TrajectoryLimits};
use urdf_rs::Robot;

use crate::error::{Error, MotionError};
use crate::parameters::Parameters;
use crate::path::TrajectoryPath;
use crate::servo::ServoConfig;

const ARM: &str = include_str!("../../../urdf/xarm7.urdf");
const CELL: &str = include_str!("../../../urdf/cell.urdf");

const TOOL: &str = "link_tcp";
/// The controller trips at 1 m/s.
const MOST_TOOL_SPEED: f64 = 0.99;
/// A touch that is less deep than this may be missed between looks, metres.
const SHALLOW: f64 = 1e-3;

/// An arm with its surroundings.
pub(crate) struct Model {
    /// As it is published.
    pub(crate) description: String,
    pub(crate) robot: Robot,
    /// Up to the tool.
    pub(crate) chain: Chain<7>,
    pub(crate) limits: TrajectoryLimits<7>,
    arm: ArmModel<7>,
    scene: Scene,
    margin: f64,
}

impl Model {
    pub(crate) fn load(parameters: &Parameters, home: &JointValues) -> Result<Self, Error> {
        let (what, description) = read(&parameters.arm_description, ARM)?;
        let wrong = |reason: &dyn std::fmt::Display| Error::Description {
            what: what.clone(),
            reason: reason.to_string(),
        };
        let robot = urdf_rs::read_from_string(&description).map_err(|error| wrong(&error))?;
        let base = &parameters.base_frame_id;
        let chain = Chain::from_urdf(&robot, base, TOOL).map_err(|error| wrong(&error))?;
        let limits = TrajectoryLimits::of_chain(&chain, parameters.acceleration, parameters.jerk, MOST_TOOL_SPEED)
            .map_err(|error| wrong(&error))?;
        let leave_out = SelfCollision {
            never: &XARM7_NEVER_TOUCHING,
            free_at: &[*home],
        };
        let arm = ArmModel::from_urdf(&robot, base, chain.clone(), &leave_out).map_err(|error| wrong(&error))?;
        Ok(Self {
            description,
            scene: scene(parameters)?,
            margin: parameters.margin,
            robot,
            chain,
            limits,
            arm,
        })
    }

    /// The same with the arm's own dimensions.
    pub(crate) fn with_dimensions(
        &self,
        base: &str,
        rows: &[ModifiedDh; 7],
        home: &JointValues,
    ) -> Result<Self, MotionError> {
        let chain = self.chain.clone().with_modified_dh(rows)?;
        let leave_out = SelfCollision {
            never: &XARM7_NEVER_TOUCHING,
            free_at: &[*home],
        };
        let arm = ArmModel::from_urdf(&self.robot, base, chain.clone(), &leave_out)?;
        Ok(Self {
            description: self.description.clone(),
            robot: self.robot.clone(),
            scene: self.scene.clone(),
            margin: self.margin,
            limits: self.limits,
            chain,
            arm,
        })
    }

    /// For motions with this speed of the tool, m/s.
    pub(crate) fn planner(&self, tool_speed: f64) -> Result<Planner<7>, MotionError> {
        let limits = TrajectoryLimits {
            tool_speed,
            ..self.limits
        };
        Ok(Planner::new(self.chain.clone(), limits)?)
    }

    /// For the servo loop of an arm that rests at home.
    pub(crate) fn servo(&self, home: &JointValues) -> Result<ServoConfig, MotionError> {
        Ok(ServoConfig::within(self.chain.clone(), &self.limits, home)?)
    }

    /// Refuses a motion with a collision on its way.
    pub(crate) fn require_free(&self, trajectory: &Trajectory<7>) -> Result<(), MotionError> {
        let checker = Checker::new(&self.arm, &self.scene).with_margin(self.margin)?;
        let Some(found) = checker.check_motion(&TrajectoryPath::new(trajectory), SHALLOW)? else {
            return Ok(());
        };
        Err(MotionError::Collision {
            time: found.time,
            link: found.contact.link.to_owned(),
            with: found.contact.with.name().to_owned(),
            distance_mm: 1e3 * found.contact.distance,
            margin_mm: 1e3 * self.margin,
        })
    }
}

fn read(file: &str, built_in: &str) -> Result<(String, String), Error> {
    if file.is_empty() {
        return Ok(("the built-in description".into(), built_in.into()));
    }
    let text = std::fs::read_to_string(file).map_err(|error| Error::Description {
        what: file.to_owned(),
        reason: error.to_string(),
    })?;
    Ok((file.to_owned(), text))
}

fn scene(parameters: &Parameters) -> Result<Scene, Error> {
    let (what, text) = read(&parameters.cell_description, CELL)?;
    let wrong = |reason: &dyn std::fmt::Display| Error::Description {
        what: what.clone(),
        reason: reason.to_string(),
    };
    let robot = urdf_rs::read_from_string(&text).map_err(|error| wrong(&error))?;
    let mut scene = Scene::from_urdf(&robot, &parameters.base_frame_id).map_err(|error| wrong(&error))?;
    // The base stands on whatever is there.
    let names: Vec<String> = scene.names().map(ToOwned::to_owned).collect();
    for name in names {
        scene
            .except(&parameters.base_frame_id, &name)
            .map_err(|error| wrong(&error))?;
    }
    Ok(scene)
}
