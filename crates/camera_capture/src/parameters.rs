//! What can be set from outside, apart from the cameras' own parameters.

use std::time::Duration;

use ros::Node;
use ros::parameters::{Parameter, ParameterError, ParameterHandle};

use devices::TriggerMode;
use photometric::LightLimits;

use crate::error::Error;

/// Full scale of the rig's cameras: 12 bits in steps of 16.
pub(crate) const FULL_SCALE: u16 = 65_520;

/// How captures are taken.
#[derive(Clone)]
pub(crate) struct Parameters {
    pub(crate) cameras: ParameterHandle<Vec<String>>,
    pub(crate) base_frame_id: ParameterHandle<String>,
    trigger: ParameterHandle<String>,
    gap: ParameterHandle<f64>,
    on_margin: ParameterHandle<f64>,
    frame_timeout: ParameterHandle<f64>,
    repeats: ParameterHandle<i64>,
    pub(crate) health: HealthParameters,
}

/// When the lights are out of order.
#[derive(Clone)]
pub(crate) struct HealthParameters {
    drift: ParameterHandle<f64>,
    dead: ParameterHandle<f64>,
    ambient_least: ParameterHandle<f64>,
    ambient_most: ParameterHandle<f64>,
}

/// The timing of one capture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CaptureOptions {
    pub(crate) trigger: TriggerMode,
    pub(crate) gap: Duration,
    pub(crate) on_margin: Duration,
    pub(crate) frame_timeout: Duration,
    pub(crate) repeats: u8,
}

impl Parameters {
    /// Declares them; the caller seals.
    pub(crate) fn declare(node: &Node) -> Result<Self, Error> {
        let parameters = node.parameters();
        let seconds = |name: &str, default: f64, range, what: &str| {
            parameters.declare(Parameter::float(name, default).unit("s").range(range).describe(what))
        };
        let declared = Self {
            cameras: parameters.declare(
                Parameter::strings("cameras", ["c1".to_owned(), "c2".to_owned()])
                    .read_only()
                    .describe("Names of the cameras; each is a namespace of topics and of parameters"),
            )?,
            base_frame_id: parameters.declare(
                Parameter::string("base_frame_id", "link_base")
                    .read_only()
                    .describe("Frame in which the panels stand as drawn; tells the panels' directions apart"),
            )?,
            trigger: parameters.declare(
                Parameter::string("trigger", "line")
                    .one_of(["line", "software"])
                    .describe("line: the light controller pulses the cameras; software: one light and frame at a time"),
            )?,
            gap: seconds(
                "gap",
                0.01,
                0.0001..=1.0,
                "From one light's end to the next one's start",
            )?,
            on_margin: seconds(
                "on_margin",
                0.001,
                0.0002..=0.1,
                "A light is on this much longer than the exposure; the lights' trigger delay must fit into it",
            )?,
            frame_timeout: seconds(
                "frame_timeout",
                0.5,
                0.05..=10.0,
                "A frame that has not come this long after the last light is missing",
            )?,
            repeats: parameters.declare(
                Parameter::integer("repeats", 1)
                    .range(0..=1)
                    .describe("How often a void capture is repeated before the service fails"),
            )?,
            health: HealthParameters::declare(node)?,
        };
        declared.check_cameras()?;
        Ok(declared)
    }

    pub(crate) fn options(&self) -> CaptureOptions {
        CaptureOptions {
            trigger: if self.trigger.get() == "software" {
                TriggerMode::Software
            } else {
                TriggerMode::Line
            },
            gap: Duration::from_secs_f64(self.gap.get()),
            on_margin: Duration::from_secs_f64(self.on_margin.get()),
            frame_timeout: Duration::from_secs_f64(self.frame_timeout.get()),
            // The parameter's range is 0 to 1.
            repeats: self.repeats.get() as u8,
        }
    }

    fn check_cameras(&self) -> Result<(), Error> {
        let found = self.cameras.get();
        let mut unique = found.clone();
        unique.sort();
        unique.dedup();
        if found.is_empty() || unique.len() != found.len() {
            return Err(Error::Cameras { found });
        }
        Ok(())
    }
}

impl HealthParameters {
    fn declare(node: &Node) -> Result<Self, ParameterError> {
        let parameters = node.parameters();
        let limit = |name: &str, default: f64, range, unit: &str, what: &str| {
            parameters.declare(Parameter::float(name, default).unit(unit).range(range).describe(what))
        };
        let share = "fraction of the reference";
        let numbers = "digital numbers";
        Ok(Self {
            drift: limit(
                "light_health.drift",
                0.2,
                0.01..=1.0,
                share,
                "Warn when a panel's share of the light is off by more",
            )?,
            dead: limit(
                "light_health.dead",
                0.1,
                0.0..=1.0,
                share,
                "A panel with a smaller share of the light counts as dead",
            )?,
            ambient_least: limit(
                "light_health.ambient_least",
                0.0,
                0.0..=65_535.0,
                numbers,
                "Warn when the dark frame's median is lower",
            )?,
            ambient_most: limit(
                "light_health.ambient_most",
                4000.0,
                0.0..=65_535.0,
                numbers,
                "Warn when the dark frame's median is higher: somebody switched a lamp on",
            )?,
        })
    }

    pub(crate) fn limits(&self) -> LightLimits {
        LightLimits {
            drift: self.drift.get(),
            dead: self.dead.get(),
        }
    }

    pub(crate) fn ambient(&self) -> std::ops::RangeInclusive<f64> {
        self.ambient_least.get()..=self.ambient_most.get()
    }
}
