//! The probe's parameters: one of every type, with ranges, a choice, and one that is read-only.

use ros::Node;
use ros::parameters::{Parameter, ParameterError, ParameterHandle};

pub(crate) struct Parameters {
    gain: ParameterHandle<f64>,
}

/// Declares them and refuses start values for any other.
pub(crate) fn declare(node: &Node) -> Result<Parameters, ParameterError> {
    let parameters = node.parameters();
    parameters.declare(Parameter::bool("enabled", true).describe("Whether it does anything"))?;
    parameters.declare(
        Parameter::integer("exposures", 8)
            .range(1..=64)
            .describe("Images of a sequence"),
    )?;
    parameters.declare(Parameter::integer("binning", 2).stepped_range(2..=8, 2))?;
    let gain = parameters.declare(
        Parameter::float("gain", 0.5)
            .unit("dB")
            .range(0.0..=24.0)
            .describe("Gain of the camera"),
    )?;
    parameters.declare(Parameter::string("mode", "solid").one_of(["solid", "thin"]))?;
    parameters.declare(
        Parameter::string("serial_number", "PROBE-1")
            .read_only()
            .describe("Of the device"),
    )?;
    parameters.declare(Parameter::new("mask", vec![0_u8, 255]))?;
    parameters.declare(Parameter::new("panels", vec![true, false, true]))?;
    parameters.declare(Parameter::integers("channels", vec![1, 2, 3]).range(0..=7))?;
    parameters.declare(
        Parameter::floats("offsets", vec![0.1, -0.1])
            .unit("m")
            .range(-1.0..=1.0),
    )?;
    parameters.declare(Parameter::strings("cameras", vec!["c1".to_owned()]).each_one_of(["c1", "c2"]))?;
    parameters.seal()?;
    Ok(Parameters { gain })
}

impl Parameters {
    /// Prints every new gain, which shows that a node learns of a change.
    pub(crate) async fn watch(mut self) -> anyhow::Result<()> {
        loop {
            println!("gain {}", self.gain.changed().await);
        }
    }
}
