//! What can be set from outside.

use devices::{ARM_JOINTS, JointValues};
use ros::Node;
use ros::parameters::{Parameter, ParameterHandle, ParameterKind};

use crate::error::Error;

/// Where the arm rests with the cup pointing down and the cameras' view free.
const HOME: JointValues = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

pub(crate) struct Parameters {
    pub(crate) host: String,
    pub(crate) control_port: u16,
    pub(crate) real_time_port: u16,
    pub(crate) rich_port: u16,
    pub(crate) vacuum_hardware: u8,
    pub(crate) calibrated_kinematics: bool,
    pub(crate) arm_at_start: bool,
    pub(crate) arm_description: String,
    pub(crate) cell_description: String,
    pub(crate) base_frame_id: String,
    pub(crate) frames_from_others: Vec<String>,
    pub(crate) priority: u8,
    pub(crate) watchdog: f64,
    pub(crate) state_timeout: f64,
    pub(crate) vacuum_timeout: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
    pub(crate) margin: f64,
    pub(crate) press_depth: f64,
    pub(crate) hold_settle: ParameterHandle<f64>,
    pub(crate) tool_speed: ParameterHandle<f64>,
    pub(crate) home: ParameterHandle<Vec<f64>>,
    pub(crate) start_tolerance: ParameterHandle<f64>,
}

impl Parameters {
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let declare = Declare(node);
        let declared = Self {
            host: declare
                .fixed(Parameter::string("host", "192.168.1.206").describe("Address of the arm's control box"))?,
            control_port: declare.port("control_port", 502, "Control port of the box")?,
            real_time_port: declare.port(
                "real_time_port",
                30003,
                "Port of the reports that come 100 times a second",
            )?,
            rich_port: declare.port("rich_port", 30002, "Port of the reports that hold everything")?,
            vacuum_hardware: declare.fixed(
                Parameter::integer("vacuum_hardware", 1)
                    .range(1..=2)
                    .describe("Vacuum gripper: 1 with a cable, 2 by contacts in the flange; the wrong one is silent"),
            )? as u8,
            calibrated_kinematics: declare.fixed(
                Parameter::bool("calibrated_kinematics", true)
                    .describe("Take the arm's own dimensions from its controller instead of the nominal ones"),
            )?,
            arm_at_start: declare.fixed(
                Parameter::bool("arm_at_start", false)
                    .describe("Switch the servos on as soon as the arm is there; otherwise `recover` does"),
            )?,
            arm_description: declare.fixed(
                Parameter::string("arm_description", "")
                    .describe("URDF of the arm with its tool; empty: the xArm7 with the vacuum cup"),
            )?,
            cell_description: declare.fixed(
                Parameter::string("cell_description", "")
                    .describe("URDF of what stands around the arm; empty: table, light panels and bin"),
            )?,
            base_frame_id: declare
                .fixed(Parameter::string("base_frame_id", "link_base").describe("Frame of the arm's base"))?,
            frames_from_others: declare.fixed(
                Parameter::strings("frames_from_others", ["c1_optical_frame".to_owned()])
                    .describe("Frames of the description whose place somebody else tells on TF"),
            )?,
            priority: declare.fixed(
                Parameter::integer("priority", 80)
                    .range(0..=99)
                    .describe("SCHED_FIFO priority of the servo thread; 0: an ordinary thread"),
            )? as u8,
            watchdog: declare.fixed(
                Parameter::float("watchdog", 0.02)
                    .unit("s")
                    .range(0.004..=0.5)
                    .describe("A servo loop that is this late stops the motion"),
            )?,
            state_timeout: declare.fixed(
                Parameter::float("state_timeout", 0.2)
                    .unit("s")
                    .range(0.02..=1.0)
                    .describe("A motion stops when the controller has reported nothing for this long"),
            )?,
            vacuum_timeout: declare.fixed(
                Parameter::float("vacuum_timeout", 10.0)
                    .unit("s")
                    .range(1.0..=600.0)
                    .describe("A pump that holds nothing is switched off when the arm has rested for this long"),
            )?,
            acceleration: declare.fixed(
                Parameter::float("acceleration", 10.0)
                    .unit("rad/s^2")
                    .range(0.1..=20.0)
                    .describe("Largest acceleration of a joint"),
            )?,
            jerk: declare.fixed(
                Parameter::float("jerk", 200.0)
                    .unit("rad/s^3")
                    .range(1.0..=2000.0)
                    .describe("Largest jerk of a joint"),
            )?,
            margin: declare.fixed(
                Parameter::float("collision_margin", 0.005)
                    .unit("m")
                    .range(0.0..=0.1)
                    .describe("What comes nearer than this counts as a collision"),
            )?,
            press_depth: declare.fixed(
                Parameter::float("press_depth", 0.005)
                    .unit("m")
                    .range(0.0..=0.01)
                    .describe("How deep the cup may press into what it touches in a motion with contact"),
            )?,
            hold_settle: declare.hold_settle()?,
            tool_speed: declare.tool_speed()?,
            home: declare.home()?,
            start_tolerance: declare.start_tolerance()?,
        };
        node.parameters().seal()?;
        declared.home()?;
        Ok(declared)
    }

    /// Home as it is set now.
    pub(crate) fn home(&self) -> Result<JointValues, Error> {
        let home = self.home.get();
        JointValues::try_from(home.as_slice()).map_err(|_| Error::Value {
            name: "home",
            reason: format!("{} angles, allowed are {ARM_JOINTS}", home.len()),
        })
    }
}

/// Those that are `fixed` only count at the start.
struct Declare<'a>(&'a Node);

impl Declare<'_> {
    fn fixed<T: ParameterKind>(&self, parameter: Parameter<T>) -> Result<T, Error> {
        Ok(self.0.parameters().declare(parameter.read_only())?.get())
    }

    fn port(&self, name: &str, default: u16, what: &str) -> Result<u16, Error> {
        let parameter = Parameter::integer(name, i64::from(default))
            .range(1..=65_535)
            .describe(what);
        Ok(self.fixed(parameter)? as u16)
    }

    fn hold_settle(&self) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float("hold_settle", 0.3)
            .unit("s")
            .range(0.0..=5.0)
            .describe("How long the cup may take to hold something at the end of a motion with until_held");
        Ok(self.0.parameters().declare(parameter)?)
    }

    fn tool_speed(&self) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float("tool_speed", 0.25)
            .unit("m/s")
            .range(0.001..=0.95)
            .describe("Largest speed of the tool; above 1 m/s the controller trips");
        Ok(self.0.parameters().declare(parameter)?)
    }

    fn home(&self) -> Result<ParameterHandle<Vec<f64>>, Error> {
        let parameter = Parameter::floats("home", HOME)
            .unit("rad")
            .describe("Joint angles of the home position, from the base on");
        Ok(self.0.parameters().declare(parameter)?)
    }

    fn start_tolerance(&self) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float("start_tolerance", 0.01)
            .unit("rad")
            .range(0.0001..=0.1)
            .describe("How far a motion may begin from where the arm stands");
        Ok(self.0.parameters().declare(parameter)?)
    }
}
