//! Panels near the work: rectangles whose light changes in direction and strength across one object.
//!
//! All quantities are relative: a rig knows how its panels compare, not how many digital numbers one gives. The signal
//! of a matte pixel is `gain · (direct + indirect)`, where the gain (albedo times exposure) is a capture's own.

use geometry::Rectangle;
use geometry::nalgebra::{Point3, Vector3};

use crate::error::PhotometricError;
use crate::nominal_rig::{PANEL_SIZE, nominal_panels};

/// Light that reaches a patch from the room, not from the panel itself: `max(0, constant + linear · n)`, in the units
/// of the panel's irradiance. First order in the normal, as in the spherical harmonics of Ramamoorthi and Hanrahan,
/// "An efficient representation for irradiance environment maps" (SIGGRAPH 2001).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// The part that every normal gets.
    pub constant: f64,
    /// Base frame; the part that depends on where the patch faces.
    pub linear: Vector3<f64>,
}

/// One panel and what the room makes of its light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PanelModel {
    /// The light's number, 1 for L1.
    pub channel: u8,
    /// Where its bright side is; base frame, metres.
    pub rectangle: Rectangle,
    /// Relative to the other panels of the rig; more than 0.
    pub radiance: f64,
    /// Its light by way of the room.
    pub bounce: Bounce,
}

/// The panels of a rig, in ascending order of their channels.
#[derive(Debug, Clone, PartialEq)]
pub struct LightRig {
    panels: Vec<PanelModel>,
}

impl Bounce {
    /// A room that swallows all light.
    pub const NONE: Self = Self {
        constant: 0.0,
        linear: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Irradiance of a patch with this unit normal (base frame).
    pub fn irradiance(&self, normal: &Vector3<f64>) -> f64 {
        (self.constant + self.linear.dot(normal)).max(0.0)
    }
}

impl PanelModel {
    /// Irradiance from the panel alone, clipped at the patch's horizon; no shadows of other surfaces.
    pub fn direct(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        self.radiance * self.rectangle.form_factor(point, normal)
    }

    /// Irradiance from the panel and from the room.
    pub fn irradiance(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        self.direct(point, normal) + self.bounce.irradiance(normal)
    }

    /// The vector whose product with a normal is [`Self::direct`], while the whole panel is above the patch's horizon.
    pub fn light_vector(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.rectangle.vector_form_factor(point) * self.radiance
    }
}

impl LightRig {
    /// Panels in any order; refuses fewer than three, a channel twice, and numbers that cannot be.
    pub fn new(mut panels: Vec<PanelModel>) -> Result<Self, PhotometricError> {
        panels.sort_by_key(|panel| panel.channel);
        if panels.len() < 3 {
            return Err(PhotometricError::TooFewLights {
                got: panels.len(),
                needed: 3,
            });
        }
        if let Some(pair) = panels.windows(2).find(|pair| pair[0].channel == pair[1].channel) {
            return Err(PhotometricError::DuplicateLight {
                channel: pair[0].channel,
            });
        }
        panels.iter().try_for_each(check)?;
        Ok(Self { panels })
    }

    /// The rig as drawn: panels alike, a black room. Where calibration begins, and better than nothing without one.
    pub fn nominal() -> Self {
        let panels = nominal_panels().map(|panel| {
            let facing = panel.facing;
            // The long side is level; a panel that looks straight down has it along base y.
            let right = Vector3::z().cross(&facing);
            let right = if right.norm() < 1e-6 { Vector3::y() } else { right };
            let rectangle = Rectangle {
                centre: panel.centre,
                facing,
                right: geometry::nalgebra::Unit::new_normalize(right),
                size: PANEL_SIZE,
            };
            PanelModel {
                channel: panel.channel,
                rectangle,
                radiance: 1.0,
                bounce: Bounce::NONE,
            }
        });
        Self {
            panels: panels.to_vec(),
        }
    }

    /// The panels, in ascending order of their channels.
    pub fn panels(&self) -> &[PanelModel] {
        &self.panels
    }

    /// The panels' channels, ascending.
    pub fn channels(&self) -> Vec<u8> {
        self.panels.iter().map(|panel| panel.channel).collect()
    }
}

fn check(panel: &PanelModel) -> Result<(), PhotometricError> {
    let channel = panel.channel;
    let intensity = panel.radiance;
    if !(intensity.is_finite() && intensity > 0.0) {
        return Err(PhotometricError::LightIntensity { channel, intensity });
    }
    let rectangle = &panel.rectangle;
    let numbers = rectangle.centre.iter().chain(panel.bounce.linear.iter());
    if let Some(&value) = numbers
        .chain([&panel.bounce.constant])
        .find(|number| !number.is_finite())
    {
        return Err(PhotometricError::OutOfRange {
            what: "a light's position or bounce",
            value,
            allowed: "finite numbers",
        });
    }
    if let Some(&value) = rectangle.size.iter().find(|size| !(1e-4..=10.0).contains(*size)) {
        return Err(PhotometricError::OutOfRange {
            what: "a panel's side",
            value,
            allowed: "0.0001 to 10 m",
        });
    }
    Ok(())
}
