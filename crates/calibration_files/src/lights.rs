//! `lights.yaml`.

use std::path::Path;

use geometry::Rectangle;
use geometry::nalgebra::{Point3, Unit, Vector3};
use photometric::{Bounce, LightRig, PanelModel};
use serde::{Deserialize, Serialize};

use crate::error::CalibrationFileError;
use crate::text_file;

/// The version this crate writes and reads.
const VERSION: u32 = 1;
/// Directions are written with six decimals or more.
const DIRECTION_TOLERANCE: f64 = 1e-4;

/// The content of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightsFile {
    version: u32,
    /// When the captures were taken or the file was made, as a person would write it.
    pub date: String,
    /// Frame of all positions and directions.
    pub frame: String,
    /// For people: lengths are metres, radiances and bounces relative.
    units: Units,
    /// Cameras the calibration was made with.
    pub made_with: Vec<MadeWith>,
    lights: Vec<Light>,
    /// How well each light fitted.
    pub residuals: Vec<LightResidual>,
    /// Where the target stood and how well it fitted there; files made before this was kept have none.
    #[serde(default)]
    pub placements: Vec<PlacementResidual>,
}

/// A camera of a calibration.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MadeWith {
    /// Its name, such as `c1`.
    pub camera: String,
    /// Columns of its images.
    pub width: usize,
    /// Rows of its images.
    pub height: usize,
}

/// How well a light fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightResidual {
    /// The light.
    pub channel: u8,
    /// Samples used.
    pub samples: usize,
    /// Median misfit in sigmas of noise.
    pub median_sigmas: f64,
    /// Root mean square misfit, per cent of the mean signal.
    pub rms_percent: f64,
}

/// Where the target stood and how well it fitted there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacementResidual {
    /// The capture's name.
    pub placement: String,
    /// The target's centre on the mat, base frame, metres; none when it was not found.
    pub centre: Option<[f64; 2]>,
    /// Median misfit in sigmas of noise; none when the target was not found.
    pub median_sigmas: Option<f64>,
    /// Why it was left out; none when it was used.
    pub left_out: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Units {
    length: String,
    radiance: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Light {
    channel: u8,
    centre: [f64; 3],
    facing: [f64; 3],
    right: [f64; 3],
    size: [f64; 2],
    radiance: f64,
    bounce_constant: f64,
    bounce_linear: [f64; 3],
}

impl LightsFile {
    /// The content for a rig in `link_base`.
    pub fn new(
        rig: &LightRig,
        date: impl Into<String>,
        made_with: Vec<MadeWith>,
        residuals: Vec<LightResidual>,
    ) -> Self {
        Self {
            version: VERSION,
            date: date.into(),
            frame: "link_base".to_owned(),
            units: Units {
                length: "m".to_owned(),
                radiance: "relative, mean 1".to_owned(),
            },
            made_with,
            lights: rig.panels().iter().map(Light::of).collect(),
            residuals,
            placements: Vec::new(),
        }
    }

    /// The same with where the target stood.
    #[must_use]
    pub fn with_placements(mut self, placements: Vec<PlacementResidual>) -> Self {
        self.placements = placements;
        self
    }

    /// Reads a file; its rig is checked as well.
    pub fn read(path: &Path) -> Result<Self, CalibrationFileError> {
        Self::from_text(&text_file::read(path)?)
    }

    /// Writes a file; one that is there is replaced.
    pub fn write(&self, path: &Path) -> Result<(), CalibrationFileError> {
        text_file::write(path, &self.to_text()?)
    }

    /// From a file's text.
    pub fn from_text(text: &str) -> Result<Self, CalibrationFileError> {
        let file: Self = serde_yaml_ng::from_str(text)?;
        if file.version != VERSION {
            return Err(CalibrationFileError::Version {
                found: file.version,
                understood: VERSION,
            });
        }
        file.rig()?;
        Ok(file)
    }

    /// As a file's text.
    pub fn to_text(&self) -> Result<String, CalibrationFileError> {
        Ok(serde_yaml_ng::to_string(self)?)
    }

    /// The lights as a solver takes them.
    pub fn rig(&self) -> Result<LightRig, CalibrationFileError> {
        let panels = self.lights.iter().map(Light::panel).collect::<Result<_, _>>()?;
        Ok(LightRig::new(panels)?)
    }

    /// Refuses a camera that the calibration was not made with; one that names no camera fits all. Lights are in the base
    /// frame, so that they fit any resolution of their cameras.
    pub fn require_camera(&self, camera: &str, width: usize, height: usize) -> Result<(), CalibrationFileError> {
        let fits = |made: &MadeWith| made.camera.eq_ignore_ascii_case(camera);
        if self.made_with.is_empty() || self.made_with.iter().any(fits) {
            return Ok(());
        }
        let names = self
            .made_with
            .iter()
            .map(|made| format!("{} ({} x {})", made.camera, made.width, made.height));
        Err(CalibrationFileError::OtherCamera {
            made_with: names.collect::<Vec<_>>().join(", "),
            camera: camera.to_owned(),
            width,
            height,
        })
    }
}

impl Light {
    fn of(panel: &PanelModel) -> Self {
        let rectangle = &panel.rectangle;
        Self {
            channel: panel.channel,
            centre: rectangle.centre.into(),
            facing: rectangle.facing.into_inner().into(),
            right: rectangle.right.into_inner().into(),
            size: rectangle.size,
            radiance: panel.radiance,
            bounce_constant: panel.bounce.constant,
            bounce_linear: panel.bounce.linear.into(),
        }
    }

    fn panel(&self) -> Result<PanelModel, CalibrationFileError> {
        let facing = self.unit("facing", self.facing)?;
        let right = self.unit("right", self.right)?;
        if facing.dot(&right).abs() > DIRECTION_TOLERANCE {
            return Err(CalibrationFileError::Direction {
                channel: self.channel,
                what: "right",
                value: self.right,
                allowed: "directions at a right angle to facing",
            });
        }
        Ok(PanelModel {
            channel: self.channel,
            rectangle: Rectangle {
                centre: Point3::from(self.centre),
                facing,
                right,
                size: self.size,
            },
            radiance: self.radiance,
            bounce: Bounce {
                constant: self.bounce_constant,
                linear: Vector3::from(self.bounce_linear),
            },
        })
    }

    fn unit(&self, what: &'static str, value: [f64; 3]) -> Result<Unit<Vector3<f64>>, CalibrationFileError> {
        let vector = Vector3::from(value);
        if (vector.norm() - 1.0).abs() <= DIRECTION_TOLERANCE {
            return Ok(Unit::new_normalize(vector));
        }
        Err(CalibrationFileError::Direction {
            channel: self.channel,
            what,
            value,
            allowed: "unit vectors",
        })
    }
}
