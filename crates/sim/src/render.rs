//! What a camera sees of a scene: one radiance image per light, before any sensor.

use imaging::Image;

use crate::SimError;
use crate::scene::{Scene, View};

/// What leaves the scene towards the camera, per pixel, and what is there. Radiance is in the panels' unit.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderedView {
    /// With all panels off.
    pub ambient: Image<f32>,
    /// What L1 to L7 add to it, each alone.
    pub lights: [Image<f32>; 7],
    /// Unit surface normals, base frame; NaN where nothing is seen.
    pub normals: Image<[f32; 3]>,
    /// Metres along the optical axis; NaN where nothing is seen.
    pub depth: Image<f32>,
    /// Body's position in the scene plus one; 0 for the room.
    pub labels: Image<u8>,
}

/// How much work goes into it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderOptions {
    /// The same seed gives the same image.
    pub seed: u64,
}

/// Renders a view on all cores of rayon's pool.
pub fn render(scene: &Scene, view: &View, options: &RenderOptions) -> Result<RenderedView, SimError> {
    let _ = (scene, view, options);
    unimplemented!("the renderer's helper writes this")
}
