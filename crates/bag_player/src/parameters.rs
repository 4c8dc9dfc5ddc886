//! What can be set from outside.

use ros::Node;
use ros::parameters::{Parameter, ParameterHandle};

use crate::error::Error;

pub(crate) struct Parameters {
    pub(crate) bag: ParameterHandle<String>,
    pub(crate) rate: ParameterHandle<f64>,
    pub(crate) repeat: ParameterHandle<bool>,
    pub(crate) leave_out: ParameterHandle<Vec<String>>,
    pub(crate) enlarge: ParameterHandle<i64>,
    pub(crate) wait_for_subscriptions: ParameterHandle<f64>,
}

impl Parameters {
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let parameters = node.parameters();
        let declared = Self {
            bag: parameters.declare(
                Parameter::string("bag", "")
                    .read_only()
                    .describe("Bag folder or .mcap file to play"),
            )?,
            rate: parameters.declare(
                Parameter::float("rate", 1.0)
                    .unit("recorded seconds per second")
                    .range(0.01..=100.0)
                    .describe("Speed; a change holds from the next round"),
            )?,
            repeat: parameters
                .declare(Parameter::bool("loop", false).describe("Whether to begin anew after the last message"))?,
            leave_out: parameters.declare(
                Parameter::strings("leave_out", Vec::new())
                    .read_only()
                    .describe("Topics that are not played, by their names in the bag"),
            )?,
            enlarge: parameters.declare(
                Parameter::integer("enlarge", 1)
                    .unit("times")
                    .range(1..=16)
                    .read_only()
                    .describe("Repeat every pixel of images this often in both directions"),
            )?,
            wait_for_subscriptions: parameters.declare(
                Parameter::float("wait_for_subscriptions", 0.0)
                    .unit("s")
                    .range(0.0..=600.0)
                    .read_only()
                    .describe(
                        "Play only once every image topic has a subscription, and give up after this long; 0: at once",
                    ),
            )?,
        };
        parameters.seal()?;
        Ok(declared)
    }
}
