//! What can be set from outside.

use ros::Node;
use ros::parameters::{Parameter, ParameterHandle};

use crate::error::Error;

pub(crate) struct Parameters {
    pub(crate) port: ParameterHandle<String>,
    pub(crate) trigger_delay: ParameterHandle<f64>,
    pub(crate) trigger_width: ParameterHandle<f64>,
}

impl Parameters {
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let parameters = node.parameters();
        let declared =
            Self {
                port: parameters.declare(Parameter::string("port", "/dev/ttyACM0").read_only().describe(
                    "Serial port of the light controller, or a link to it such as those in /dev/serial/by-id",
                ))?,
                trigger_delay: parameters.declare(
                    Parameter::float("trigger_delay", 0.0001)
                        .unit("s")
                        .range(0.0..=0.065)
                        .describe("From a panel's rising edge to that of the cameras' trigger; 0, or at least 64 us"),
                )?,
                trigger_width: parameters.declare(
                    Parameter::float("trigger_width", 0.0002)
                        .unit("s")
                        .range(0.000_064..=0.065)
                        .describe("Length of the trigger pulse; it ends at least 64 us before the panel goes off"),
                )?,
            };
        parameters.seal()?;
        Ok(declared)
    }
}
