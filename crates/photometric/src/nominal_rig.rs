//! The rig as drawn: where the panels should be before anybody calibrated them.

use nalgebra::{Point3, Unit, Vector3};

use crate::directional_light::DirectionalLight;
use crate::error::PhotometricError;

/// Centre of the workspace mat, base frame, metres.
pub(crate) const WORKSPACE_CENTRE: Point3<f64> = Point3::new(0.43, 0.0, 0.0);
/// The grazing panels face a point this far over the centre, metres.
const AIM_HEIGHT: f64 = 0.02;
/// Distance of the grazing panels from the vertical through the centre, metres.
const RING_RADIUS: f64 = 0.50;
/// Height of the grazing panels' centres over the table, metres.
const RING_HEIGHT: f64 = 0.15;
/// Height of the overhead panel, metres.
const OVERHEAD_HEIGHT: f64 = 0.90;
/// Long and short side of every panel, metres.
pub(crate) const PANEL_SIZE: [f64; 2] = [0.25, 0.1];
const RING_PANELS: u8 = 6;
const FIRST_AZIMUTH_DEGREES: f64 = 30.0;
const AZIMUTH_STEP_DEGREES: f64 = 60.0;

/// A flat, evenly bright panel, by its centre and the way it faces; base frame, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PanelLight {
    /// The light's number, 1 for L1.
    pub channel: u8,
    /// Middle of the panel.
    pub centre: Point3<f64>,
    /// Unit vector out of the bright side.
    pub facing: Unit<Vector3<f64>>,
}

impl PanelLight {
    /// The panel as seen from `point` (base frame, metres), as if it were far away.
    ///
    /// The intensity is what a small panel of unit area and radiance gives a patch turned towards it: the cosine at
    /// the panel over the distance squared. All panels of the rig are alike, so area and radiance cancel between them;
    /// without the distance the overhead panel, nearly twice as far as the others, would count three times too much.
    pub fn directional_light(&self, point: [f64; 3]) -> Result<DirectionalLight, PhotometricError> {
        let to_light = self.centre - Point3::from(point);
        let distance = to_light.norm();
        let cosine = -self.facing.dot(&to_light) / distance;
        // Written so that a NaN position is refused as well.
        if cosine > 0.0 {
            return DirectionalLight::new(self.channel, to_light.into(), cosine / (distance * distance));
        }
        Err(PhotometricError::BehindPanel {
            channel: self.channel,
            point,
            cosine,
        })
    }
}

/// The rig's seven panels: L1 to L6 in a hexagon at azimuth 30 to 330 degrees around the workspace centre, grazing,
/// L7 overhead and facing down.
pub fn nominal_panels() -> [PanelLight; 7] {
    std::array::from_fn(|index| match index as u8 {
        index if index < RING_PANELS => ring_panel(index),
        index => PanelLight {
            channel: index + 1,
            centre: WORKSPACE_CENTRE + Vector3::z() * OVERHEAD_HEIGHT,
            facing: -Vector3::z_axis(),
        },
    })
}

fn ring_panel(index: u8) -> PanelLight {
    let azimuth = (FIRST_AZIMUTH_DEGREES + f64::from(index) * AZIMUTH_STEP_DEGREES).to_radians();
    let offset = Vector3::new(RING_RADIUS * azimuth.cos(), RING_RADIUS * azimuth.sin(), RING_HEIGHT);
    let aim = Vector3::z() * AIM_HEIGHT;
    PanelLight {
        channel: index + 1,
        centre: WORKSPACE_CENTRE + offset,
        facing: Unit::new_normalize(aim - offset),
    }
}
