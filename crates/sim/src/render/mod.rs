//! What a camera sees of a scene: one radiance image per light, before any sensor.
//!
//! The light of a panel is exact where the whole panel is seen (Lambert's polygon formula, cut at the surface's own
//! horizon); rays find how much of it is hidden. The same seed gives the same image on any number of threads.

mod block;
mod chart;
mod direct;
mod group;
mod indirect;
mod polygon;
mod primary;
mod radiosity;
mod random;
mod rectangle;
mod shade;
mod stage;

use imaging::Image;
use rayon::prelude::*;

use crate::SimError;
use crate::scene::{Scene, View};

use indirect::Indirect;
use primary::Primary;
use radiosity::Radiosity;
use shade::{AMBIENT, CHANNELS, Shader};
use stage::Stage;

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
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RenderOptions {
    /// The same seed gives the same image.
    pub seed: u64,
}

/// Bodies that labels can tell apart.
const MAX_BODIES: usize = 255;

/// Renders a view on all cores of rayon's pool.
pub fn render(scene: &Scene, view: &View, options: &RenderOptions) -> Result<RenderedView, SimError> {
    let bodies = scene.bodies.len();
    if bodies > MAX_BODIES {
        let allowed = format!("at most {MAX_BODIES}");
        return Err(SimError::value("number of bodies", bodies.to_string(), allowed));
    }
    let stage = Stage::new(scene)?;
    let primary = Primary::new(&stage, view)?;
    let radiosity = Radiosity::new(&stage, options.seed);
    let indirect = Indirect::new(&primary, &radiosity, options.seed);
    let shader = Shader {
        primary: &primary,
        indirect: &indirect,
        seed: options.seed,
    };
    develop(&primary, &shader.shade())
}

/// Sorts what was computed per pixel into images.
fn develop(primary: &Primary<'_>, radiance: &[[f32; CHANNELS]]) -> Result<RenderedView, SimError> {
    let channel = |channel: usize| radiance.iter().map(|light| light[channel]).collect();
    let image = |pixels: Vec<f32>| Image::new(primary.width, primary.height, pixels);
    let [l1, l2, l3, l4, l5, l6, l7] = std::array::from_fn(|light| image(channel(light)));
    let label = |x, y| body_seen(primary, x, y).map_or(0, |body| (body + 1) as u8);
    Ok(RenderedView {
        ambient: image(channel(AMBIENT))?,
        lights: [l1?, l2?, l3?, l4?, l5?, l6?, l7?],
        normals: Image::new(primary.width, primary.height, normals(primary))?,
        depth: Image::from_fn(primary.width, primary.height, |x, y| primary.depth(x, y)),
        labels: Image::from_fn(primary.width, primary.height, label),
    })
}

fn body_seen(primary: &Primary<'_>, x: usize, y: usize) -> Option<usize> {
    primary.stage.body(primary.place(x, y)?.surface)
}

fn normals(primary: &Primary<'_>) -> Vec<[f32; 3]> {
    let width = primary.width;
    let normal = |index: usize| {
        let place = primary.place(index % width, index / width);
        place.map_or([f32::NAN; 3], |place| place.normal.map(|n| n as f32).into())
    };
    (0..width * primary.height).into_par_iter().map(normal).collect()
}
