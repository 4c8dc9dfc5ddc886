//! The arm and what stands around it: what motions are planned with and checked against.

use collision::{ArmModel, Scene, SelfCollision, XARM7_NEVER_TOUCHING};
use devices::JointValues;
use kinematics::{Chain, ModifiedDh};
use trajectory::{Planner, TrajectoryLimits};
use urdf_rs::Robot;

use crate::error::{Error, MotionError};
use crate::parameters::Parameters;
use crate::servo::ServoConfig;

const ARM: &str = include_str!("../../../urdf/xarm7.urdf");
const CELL: &str = include_str!("../../../urdf/cell.urdf");

const TOOL: &str = "link_tcp";
/// The controller trips at 1 m/s.
const MOST_TOOL_SPEED: f64 = 0.99;

/// An arm with its surroundings.
pub(crate) struct Model {
    /// As it is published.
    pub(crate) description: String,
    pub(crate) robot: Robot,
    /// Up to the tool.
    pub(crate) chain: Chain<7>,
    pub(crate) limits: TrajectoryLimits<7>,
    pub(crate) arm: ArmModel<7>,
    pub(crate) scene: Scene,
    /// What comes nearer collides, metres.
    pub(crate) margin: f64,
    /// How deep the cup may press, metres.
    pub(crate) press_depth: f64,
    /// Joint angles (radians) that are free.
    pub(crate) home: JointValues,
}

/// What a model is made of.
pub(crate) struct ModelConfig {
    /// Where it is from, and its text: of the arm with its tool, and of what stands around it.
    pub(crate) arm: (String, String),
    pub(crate) cell: (String, String),
    /// The arm's base.
    pub(crate) base: String,
    /// Of each joint, rad/s².
    pub(crate) acceleration: f64,
    /// Of each joint, rad/s³.
    pub(crate) jerk: f64,
    /// What comes nearer collides, metres.
    pub(crate) margin: f64,
    /// How deep the cup may press, metres.
    pub(crate) press_depth: f64,
}

impl ModelConfig {
    pub(crate) fn read(parameters: &Parameters) -> Result<Self, Error> {
        Ok(Self {
            arm: read(&parameters.arm_description, ARM)?,
            cell: read(&parameters.cell_description, CELL)?,
            base: parameters.base_frame_id.clone(),
            acceleration: parameters.acceleration,
            jerk: parameters.jerk,
            margin: parameters.margin,
            press_depth: parameters.press_depth,
        })
    }

    fn robot(&self) -> Result<Robot, Error> {
        let (what, text) = &self.arm;
        urdf_rs::read_from_string(text).map_err(|error| wrong(what, &error))
    }

    fn scene(&self) -> Result<Scene, Error> {
        let (what, text) = &self.cell;
        let robot = urdf_rs::read_from_string(text).map_err(|error| wrong(what, &error))?;
        let mut scene = Scene::from_urdf(&robot, &self.base).map_err(|error| wrong(what, &error))?;
        // The base stands on whatever is there.
        let names: Vec<String> = scene.names().map(ToOwned::to_owned).collect();
        for name in names {
            scene.except(&self.base, &name).map_err(|error| wrong(what, &error))?;
        }
        Ok(scene)
    }
}

impl Model {
    pub(crate) fn new(config: ModelConfig, home: &JointValues) -> Result<Self, Error> {
        let what = &config.arm.0;
        let (robot, base) = (config.robot()?, &config.base);
        let chain = Chain::from_urdf(&robot, base, TOOL).map_err(|error| wrong(what, &error))?;
        let limits = TrajectoryLimits::of_chain(&chain, config.acceleration, config.jerk, MOST_TOOL_SPEED)
            .map_err(|error| wrong(what, &error))?;
        let leave_out = SelfCollision {
            never: &XARM7_NEVER_TOUCHING,
            free_at: &[*home],
        };
        let arm = ArmModel::from_urdf(&robot, base, chain.clone(), &leave_out).map_err(|error| wrong(what, &error))?;
        Ok(Self {
            scene: config.scene()?,
            description: config.arm.1,
            margin: config.margin,
            press_depth: config.press_depth,
            home: *home,
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
            press_depth: self.press_depth,
            home: *home,
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

fn wrong(what: &str, reason: &dyn std::fmt::Display) -> Error {
    Error::Description {
        what: what.to_owned(),
        reason: reason.to_string(),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) const HOME: JointValues = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

    /// The arm and the cell that are built in, with the parameters' defaults.
    pub(crate) fn model() -> Model {
        let config = ModelConfig {
            arm: read("", ARM).expect("built in"),
            cell: read("", CELL).expect("built in"),
            base: "link_base".to_owned(),
            acceleration: 10.0,
            jerk: 200.0,
            margin: 0.005,
            press_depth: 0.005,
        };
        Model::new(config, &HOME).expect("the descriptions are sound")
    }
}
