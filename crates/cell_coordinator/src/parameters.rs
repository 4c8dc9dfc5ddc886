//! What can be set from outside.

use std::ops::RangeInclusive;
use std::time::Duration;

use geometry::nalgebra::Point3;
use ros::Node;
use ros::parameters::{Parameter, ParameterHandle};

use crate::cycle::{Bin, Carried, Limits, Mode, Policy};
use crate::error::Error;

/// Where the bin stands (`urdf/cell.urdf`), metres.
const BIN: [f64; 3] = [0.18, 0.36, 0.0];
/// Contacts are known to better than 1 mm. A cup that gives 5 mm is then not pressed too far by a contact 1.2 mm too low
/// and 6 degrees askew, the worst that was seen; metres.
const OVERTRAVEL: f64 = 0.002;

pub(crate) struct Parameters {
    pub(crate) cameras: Vec<String>,
    mode: ParameterHandle<String>,
    attempts: ParameterHandle<i64>,
    verify: ParameterHandle<bool>,
    overtravel: ParameterHandle<f64>,
    approach_speed: ParameterHandle<f64>,
    carried: CarriedParameters,
    bin: BinParameters,
    lift: ParameterHandle<f64>,
    longest_leg: ParameterHandle<f64>,
    timeouts: Timeouts,
    pub(crate) record: ParameterHandle<String>,
    pub(crate) record_folder: ParameterHandle<String>,
}

struct CarriedParameters {
    radius: ParameterHandle<f64>,
    length: ParameterHandle<f64>,
}

struct BinParameters {
    position: ParameterHandle<Vec<f64>>,
    rim: ParameterHandle<f64>,
    clearance: ParameterHandle<f64>,
}

struct Timeouts {
    capture: ParameterHandle<f64>,
    solve: ParameterHandle<f64>,
    plan: ParameterHandle<f64>,
    execute: ParameterHandle<f64>,
    release: ParameterHandle<f64>,
    interrupt: ParameterHandle<f64>,
    node: Duration,
    arm_state: ParameterHandle<f64>,
}

impl Parameters {
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let declare = Declare(node);
        let parameters = node.parameters();
        let cameras = Parameter::strings("cameras", ["c1".to_owned(), "c2".to_owned()])
            .read_only()
            .describe("Cameras that are looked with; a cycle goes on without those that are gone");
        let mode = Parameter::string("mode", "auto")
            .one_of(["auto", "solid", "thin"])
            .describe("What the service `pick` looks for; auto: a solid object, and a thin one when there is none");
        let attempts = Parameter::integer("attempts", 3)
            .range(1..=10)
            .describe("How often the arm may go for an object in one cycle");
        let verify = Parameter::bool("verify", true)
            .describe("Look with a second capture whether the object is gone; otherwise it counts as gone");
        let speed = Parameter::float("approach_speed", 0.05)
            .unit("m/s")
            .range(0.001..=0.25)
            .describe("Of the tool on its way onto the object");
        let record = Parameter::string("record", "none")
            .one_of(["none", "all"])
            .describe("all: a bag of every cycle; bags cannot be taken back, so there is none of failures alone");
        let folder = Parameter::string("record_folder", "").describe(
            "Folder of the bags cycle_1, cycle_2, ...; it must exist; relative to the recorder's, empty: that one",
        );
        let declared = Self {
            cameras: parameters.declare(cameras)?.get(),
            mode: parameters.declare(mode)?,
            attempts: parameters.declare(attempts)?,
            verify: parameters.declare(verify)?,
            overtravel: declare.metres(
                "overtravel",
                OVERTRAVEL,
                0.0..=0.02,
                "How far the approach goes on behind the contact",
            )?,
            approach_speed: parameters.declare(speed)?,
            carried: CarriedParameters::declare(&declare)?,
            bin: BinParameters::declare(&declare)?,
            lift: declare.metres(
                "lift",
                0.1,
                0.0..=0.5,
                "How far up an object is lifted that the cup holds when a cycle begins",
            )?,
            longest_leg: declare.seconds(
                "longest_leg",
                20.0,
                1.0..=600.0,
                "A leg of the way that would take longer is refused: near a singularity the arm is slow",
            )?,
            timeouts: Timeouts::declare(&declare)?,
            record: parameters.declare(record)?,
            record_folder: parameters.declare(folder)?,
        };
        parameters.seal()?;
        if declared.cameras.is_empty() {
            return Err(Error::Value {
                name: "cameras",
                reason: "no camera, allowed: at least 1".into(),
            });
        }
        declared.policy()?;
        Ok(declared)
    }

    /// As it is now.
    pub(crate) fn policy(&self) -> Result<Policy, Error> {
        Ok(Policy {
            attempts: self.attempts.get() as u32,
            verify: self.verify.get(),
            overtravel: self.overtravel.get(),
            approach_speed: self.approach_speed.get(),
            carried: self.carried(),
            bin: self.bin.read()?,
            lift: self.lift.get(),
            longest_leg: Duration::from_secs_f64(self.longest_leg.get()),
            limits: self.timeouts.limits(),
        })
    }

    pub(crate) fn carried(&self) -> Carried {
        Carried {
            radius: self.carried.radius.get(),
            length: self.carried.length.get(),
        }
    }

    /// What the service `pick` looks for, in this order.
    pub(crate) fn modes(&self) -> Vec<Mode> {
        match self.mode.get().as_str() {
            "solid" => vec![Mode::Solid],
            "thin" => vec![Mode::Thin],
            _ => vec![Mode::Solid, Mode::Thin],
        }
    }

    pub(crate) fn node_timeout(&self) -> Duration {
        self.timeouts.node
    }

    pub(crate) fn arm_state_timeout(&self) -> Duration {
        Duration::from_secs_f64(self.timeouts.arm_state.get())
    }

    pub(crate) fn interrupt_timeout(&self) -> Duration {
        Duration::from_secs_f64(self.timeouts.interrupt.get())
    }
}

impl CarriedParameters {
    fn declare(declare: &Declare<'_>) -> Result<Self, Error> {
        Ok(Self {
            radius: declare.metres(
                "carried.radius",
                0.05,
                0.001..=0.5,
                "Of the cylinder about the tool's axis in which an object hangs when the planner does not say",
            )?,
            length: declare.metres(
                "carried.length",
                0.05,
                0.0..=0.5,
                "Of that cylinder, from the cup's lip outwards",
            )?,
        })
    }
}

impl BinParameters {
    fn declare(declare: &Declare<'_>) -> Result<Self, Error> {
        let position = Parameter::floats("bin.position", BIN)
            .unit("m")
            .range(-2.0..=2.0)
            .describe("Middle of the bin's floor in the robot's base: x, y, z");
        Ok(Self {
            position: declare.0.parameters().declare(position)?,
            rim: declare.metres("bin.rim", 0.06, 0.0..=1.0, "Height of the bin's walls over that")?,
            clearance: declare.metres(
                "bin.clearance",
                0.02,
                0.0..=0.5,
                "Between the rim and the lower end of what is let go",
            )?,
        })
    }

    fn read(&self) -> Result<Bin, Error> {
        let position = self.position.get();
        let three: [f64; 3] = position.as_slice().try_into().map_err(|_| Error::Value {
            name: "bin.position",
            reason: format!("{position:?}, allowed: three numbers"),
        })?;
        Ok(Bin {
            position: Point3::from(three),
            rim: self.rim.get(),
            clearance: self.clearance.get(),
        })
    }
}

impl Timeouts {
    fn declare(declare: &Declare<'_>) -> Result<Self, Error> {
        let seconds = |name, default, range, what| declare.seconds(name, default, range, what);
        let node = Parameter::float("node_timeout", 2.0)
            .unit("s")
            .range(0.5..=60.0)
            .read_only()
            .describe("A node that has not answered for this long counts as gone");
        Ok(Self {
            capture: seconds("timeouts.capture", 20.0, 0.1..=600.0, "Of the stage")?,
            solve: seconds("timeouts.solve", 30.0, 0.1..=600.0, "Of the stage")?,
            plan: seconds("timeouts.plan", 30.0, 0.1..=600.0, "Of the stage, dry runs included")?,
            execute: seconds("timeouts.execute", 120.0, 0.1..=600.0, "Of the stage")?,
            release: seconds(
                "release_timeout",
                2.0,
                0.1..=60.0,
                "From switching the pump off until the cup holds nothing",
            )?,
            interrupt: seconds(
                "interrupt_timeout",
                3.0,
                0.1..=60.0,
                "From being told to end until a motion has; then the arm is stopped",
            )?,
            node: Duration::from_secs_f64(declare.0.parameters().declare(node)?.get()),
            arm_state: seconds(
                "arm_state_timeout",
                0.5,
                0.1..=10.0,
                "Without an arm/state that is newer than this nothing moves",
            )?,
        })
    }

    fn limits(&self) -> Limits {
        let seconds = |handle: &ParameterHandle<f64>| Duration::from_secs_f64(handle.get());
        Limits {
            capture: seconds(&self.capture),
            solve: seconds(&self.solve),
            plan: seconds(&self.plan),
            execute: seconds(&self.execute),
            release: seconds(&self.release),
            interrupt: seconds(&self.interrupt),
        }
    }
}

/// For parameters of one kind.
struct Declare<'a>(&'a Node);

impl Declare<'_> {
    fn metres(
        &self,
        name: &str,
        default: f64,
        range: RangeInclusive<f64>,
        what: &str,
    ) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float(name, default).unit("m").range(range).describe(what);
        Ok(self.0.parameters().declare(parameter)?)
    }

    fn seconds(
        &self,
        name: &str,
        default: f64,
        range: RangeInclusive<f64>,
        what: &str,
    ) -> Result<ParameterHandle<f64>, Error> {
        let parameter = Parameter::float(name, default).unit("s").range(range).describe(what);
        Ok(self.0.parameters().declare(parameter)?)
    }
}
