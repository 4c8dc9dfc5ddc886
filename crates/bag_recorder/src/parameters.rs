//! What can be set from outside.

use ros::Node;
use ros::parameters::{Parameter, ParameterHandle};

use crate::error::Error;

/// Six captures of two cameras.
const MAX_QUEUE_BYTES: i64 = 512 << 20;

pub(crate) struct Parameters {
    pub(crate) cameras: ParameterHandle<Vec<String>>,
    pub(crate) folder: ParameterHandle<String>,
    pub(crate) max_queue_bytes: ParameterHandle<i64>,
}

impl Parameters {
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let parameters = node.parameters();
        let declared = Self {
            cameras: parameters.declare(
                Parameter::strings("cameras", ["c1".to_owned(), "c2".to_owned()])
                    .read_only()
                    .describe("Cameras that are recorded; each is a namespace below the node's"),
            )?,
            folder: parameters.declare(
                Parameter::string("folder", "recordings")
                    .describe("Folder of new bags, made when it is missing; relative to where the node was started"),
            )?,
            max_queue_bytes: parameters.declare(
                Parameter::integer("max_queue_bytes", MAX_QUEUE_BYTES)
                    .unit("bytes")
                    .range((1 << 20)..=(64 << 30))
                    .describe(
                        "Messages that wait for the disk; what exceeds this is dropped. A change holds from the next bag",
                    ),
            )?,
        };
        parameters.seal()?;
        Ok(declared)
    }
}
