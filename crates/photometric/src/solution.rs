//! What a solver says of each pixel.

use geometry::nalgebra::Vector3;
use imaging::{ExposureStack, Image, Mask};

use crate::light_rig::LightRig;
use crate::sensor_noise::SensorNoise;
use crate::view::{PixelRays, View};

/// A capture and what is known about it.
#[derive(Debug, Clone, Copy)]
pub struct Capture<'a> {
    /// Dark and lit images.
    pub stack: &'a ExposureStack,
    /// From where.
    pub view: &'a View,
    /// Of that view's camera.
    pub rays: &'a PixelRays,
    /// Under which lights.
    pub rig: &'a LightRig,
    /// Of that camera.
    pub noise: SensorNoise,
}

/// Normals of one view with what is known about their quality. All images have the capture's size.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalSolution {
    /// Unit vectors, base frame; NaN where nothing can be said.
    pub normals: Image<[f32; 3]>,
    /// Relative to the view's usual surface (1); NaN where nothing can be said.
    pub albedo: Image<f32>,
    /// 0 (guess) to 1 (as good as noise allows); 0 where nothing can be said.
    pub confidence: Image<f32>,
    /// Root mean square of the misfit under the lights that were used, in multiples of the noise; NaN outside.
    pub residual: Image<f32>,
    /// Bit i set: the pixel is in the shadow (cast or attached) of the i-th light of the rig.
    pub shadows: Image<u8>,
    /// How many lights reach the pixel; fewer than 3 marks a normal that leans on its neighbours.
    pub lights_used: Image<u8>,
    /// The pixels that were asked for.
    pub mask: Mask,
    /// Digital numbers that a patch of albedo 1 gives for one unit of irradiance.
    pub gain: f64,
}

impl NormalSolution {
    /// The normal of a pixel as a vector, none where nothing can be said.
    pub fn normal(&self, x: usize, y: usize) -> Option<Vector3<f32>> {
        let normal = *self.normals.get(x, y)?;
        normal[0].is_finite().then(|| Vector3::from(normal))
    }
}
