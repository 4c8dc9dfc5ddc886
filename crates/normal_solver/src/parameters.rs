//! What can be set from outside.

use geometry::RigidTransform;
use photometric::nominal_panels;
use ros::Node;
use ros::parameters::{Parameter, ParameterHandle};

use crate::error::Error;
use crate::lights::lights_in_base;

/// Where the panels' directions are taken from unless configured: the mat's centre, at half the height of a usual
/// object (base frame, metres).
const NOMINAL_POINT: [f64; 3] = [0.43, 0.0, 0.015];

/// Full scale of the rig's cameras: 12 bits in steps of 16.
const SATURATION: i64 = 65_520;

pub(crate) struct Parameters {
    pub(crate) cameras: ParameterHandle<Vec<String>>,
    pub(crate) base_frame_id: ParameterHandle<String>,
    pub(crate) capture_timeout: ParameterHandle<f64>,
    pub(crate) solve_timeout: ParameterHandle<f64>,
    pub(crate) saturation: ParameterHandle<i64>,
    pub(crate) minimum_signal: ParameterHandle<f64>,
    pub(crate) lights_file: ParameterHandle<String>,
    pub(crate) light_frame_id: ParameterHandle<String>,
    pub(crate) light_directions: ParameterHandle<Vec<f64>>,
    pub(crate) light_intensities: ParameterHandle<Vec<f64>>,
}

impl Parameters {
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let parameters = node.parameters();
        let (directions, intensities) = nominal_lights()?;
        let declared = Self {
            cameras: parameters.declare(
                Parameter::strings("cameras", ["c1".to_owned(), "c2".to_owned()])
                    .read_only()
                    .describe("Cameras whose captures are solved; each is a namespace below the node's"),
            )?,
            base_frame_id: parameters
                .declare(Parameter::string("base_frame_id", "link_base").describe("Frame of the published normals"))?,
            capture_timeout: parameters.declare(
                Parameter::float("capture_timeout", 5.0)
                    .unit("s")
                    .range(0.1..=600.0)
                    .describe("A capture that is not whole after this long is void"),
            )?,
            solve_timeout: parameters.declare(
                Parameter::float("solve_timeout", 10.0)
                    .unit("s")
                    .range(0.0..=600.0)
                    .describe("How long a call of solve waits for a capture that is under way"),
            )?,
            saturation: parameters.declare(
                Parameter::integer("saturation", SATURATION)
                    .unit("digital numbers")
                    .range(1..=65_535)
                    .describe("Samples at or above this value are not used"),
            )?,
            minimum_signal: parameters.declare(
                Parameter::float("minimum_signal", 300.0)
                    .unit("digital numbers")
                    .range(0.0..=65_535.0)
                    .describe("Pixels that no light makes brighter than this over the dark frame are not measured"),
            )?,
            lights_file: parameters.declare(Parameter::string("lights.file", "").read_only().describe(
                "Calibration of the panels; without it the lights are far away, as lights.directions says",
            ))?,
            light_frame_id: parameters
                .declare(Parameter::string("lights.frame_id", "link_base").describe("Frame of lights.directions"))?,
            light_directions: parameters
                .declare(Parameter::floats("lights.directions", directions).describe(
                    "Three numbers for each light, L1 first: from the surface towards the light, any length",
                ))?,
            light_intensities: parameters.declare(
                Parameter::floats("lights.intensities", intensities)
                    .unit("relative")
                    .describe("One number for each light, L1 first: irradiance of a surface that faces the light"),
            )?,
        };
        parameters.seal()?;
        Ok(declared)
    }

    /// The lights in the frame they are given in, if they make sense at all.
    pub(crate) fn check_lights(&self) -> Result<(), Error> {
        let (directions, intensities) = (self.light_directions.get(), self.light_intensities.get());
        lights_in_base(&directions, &intensities, &RigidTransform::identity()).map(drop)
    }
}

/// Directions and intensities of the rig as drawn, seen from the middle of the workspace.
fn nominal_lights() -> Result<(Vec<f64>, Vec<f64>), Error> {
    let mut directions = Vec::new();
    let mut intensities = Vec::new();
    for panel in nominal_panels() {
        let light = panel.directional_light(NOMINAL_POINT)?;
        directions.extend(light.direction().iter());
        intensities.push(light.intensity());
    }
    Ok((directions, intensities))
}
