//! Lights so far away that direction and strength are the same everywhere.

use nalgebra::{Unit, Vector3};

use crate::error::PhotometricError;

/// A distant light: one direction, one strength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionalLight {
    channel: u8,
    direction: Unit<Vector3<f64>>,
    intensity: f64,
}

impl DirectionalLight {
    /// `direction` points from the surface to the light and need not be a unit vector; normals come out in its frame.
    /// `intensity` is relative to the other lights: the brightness of a white surface facing this one.
    pub fn new(channel: u8, direction: [f64; 3], intensity: f64) -> Result<Self, PhotometricError> {
        let direction_or_none = Unit::try_new(Vector3::from(direction), 1e-12).filter(|unit| unit.norm().is_finite());
        let Some(unit) = direction_or_none else {
            return Err(PhotometricError::LightDirection { channel, direction });
        };
        if !(intensity.is_finite() && intensity > 0.0) {
            return Err(PhotometricError::LightIntensity { channel, intensity });
        }
        Ok(Self {
            channel,
            direction: unit,
            intensity,
        })
    }

    /// The light's number, 1 for L1.
    pub fn channel(&self) -> u8 {
        self.channel
    }

    /// Unit vector from the surface to the light.
    pub fn direction(&self) -> Unit<Vector3<f64>> {
        self.direction
    }

    /// Strength relative to the other lights.
    pub fn intensity(&self) -> f64 {
        self.intensity
    }
}
