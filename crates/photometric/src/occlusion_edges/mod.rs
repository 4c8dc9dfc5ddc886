//! Where one surface hides another, from the shadows beside it.
//!
//! Under a light from the side, a surface that stands over another one throws a shadow that begins at its border, as
//! the camera sees it, on the side away from the light. Walking away from a light, a depth edge is a step from a lit
//! pixel to one in cast shadow; the far end of a shadow is the opposite step (Raskar et al., "Non-photorealistic
//! camera: depth edge detection and stylized rendering using multi-flash imaging", SIGGRAPH 2004, section 2).
//!
//! Flashes around a lens shade a surface alike, so that paper divides an image by the largest of all. Panels beside the
//! work do not, so here an image is divided by what the overhead light and the lights of the other side say a matte
//! surface would show: prints cancel as they do there, and a facet that merely faces away from a light is expected to
//! be dark, while a pixel in cast shadow is not.

mod grid;
mod padded;
mod smoothing;
mod states;
mod steps;
mod thinning;
mod trace;

use imaging::{Image, Mask};

use crate::error::PhotometricError;
use crate::solution::Capture;

/// What edges are found in.
#[derive(Debug, Clone, Copy)]
pub struct EdgeInput<'a> {
    /// Images, view and lights; the lights' radiances must be calibrated.
    pub capture: &'a Capture<'a>,
    /// Edges are kept in it and just outside its border; everywhere without one.
    pub mask: Option<&'a Mask>,
    /// Along the optical axis, metres, NaN where unknown; a level plane is assumed there.
    pub depth: Option<&'a Image<f32>>,
}

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeOptions {
    /// How far to either side of an edge its lit and its shadowed surface are looked at, metres. Walls that are seen
    /// narrower than twice this count as part of the edge; surfaces narrower than this are missed.
    pub reach: f64,
    /// Height over the table where no depth is given, metres: half of a usual object's.
    pub height: f64,
    /// Edges begin where confidence is above this; 0 to 1.
    pub strong: f32,
    /// And go on as long as it is above this; 0 to 1, at most `strong`.
    pub weak: f32,
}

/// Depth edges of one view, in the size of the capture.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeMap {
    /// Lines one pixel wide; gaps shorter than the reach are closed, at whatever confidence.
    pub edges: Mask,
    /// 0 (no sign of an edge) to 1 (from fully lit to fully dark within the reach); not thinned.
    pub confidence: Image<f32>,
    /// Channels of the lights whose shadows were looked at, ascending.
    pub lights: Vec<u8>,
}

impl EdgeMap {
    /// Nothing is there to hide anything.
    fn without_objects(mask: &Mask) -> Self {
        let image = mask.as_image();
        Self {
            edges: mask.clone(),
            confidence: Image::filled(image.width(), image.height(), 0.0),
            lights: Vec::new(),
        }
    }
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self {
            reach: 0.0012,
            height: 0.015,
            strong: 0.35,
            weak: 0.15,
        }
    }
}

/// Finds depth edges: steps from lit to cast shadow, walking away from a light.
///
/// # Errors
/// An image of some panel is missing; rays, mask or depth of another size; options out of range; no light whose shadow
/// other lights can tell (it takes one overhead, one on the other side, and a fourth).
pub fn occlusion_edges(input: &EdgeInput<'_>, options: &EdgeOptions) -> Result<EdgeMap, PhotometricError> {
    check(input, options)?;
    if let Some(mask) = input.mask.filter(|mask| mask.count() == 0) {
        return Ok(EdgeMap::without_objects(mask));
    }
    let grid = grid::Grid::new(input, options);
    let lights = grid.lights(input.capture.rig);
    if lights.is_empty() {
        return Err(PhotometricError::NoOpposedLights {
            present: input.capture.rig.channels(),
        });
    }
    let states = states::States::new(input.capture, input.mask, &grid)?;
    let strengths = steps::strengths(&states, &grid);
    let thresholds = trace::Thresholds {
        strong: steps::quantised(options.strong),
        weak: steps::quantised(options.weak),
        least_pixels: grid.least_pixels(),
    };
    let regions = trace::regions(&strengths, thresholds);
    Ok(EdgeMap {
        edges: thinning::lines(regions, grid.bridge(), input.mask),
        confidence: steps::confidence(&strengths),
        lights,
    })
}

fn check(input: &EdgeInput<'_>, options: &EdgeOptions) -> Result<(), PhotometricError> {
    let capture = input.capture;
    capture.view.require_rays(capture.rays)?;
    let camera = &capture.view.camera;
    let expected = (camera.width(), camera.height());
    let mask = input.mask.map(Mask::as_image);
    let sizes = [
        ("the images", Some((capture.stack.width(), capture.stack.height()))),
        ("the mask", mask.map(|mask| (mask.width(), mask.height()))),
        ("the depth", input.depth.map(|depth| (depth.width(), depth.height()))),
    ];
    for (what, size) in sizes {
        let (width, height) = size.unwrap_or(expected);
        if (width, height) != expected {
            return Err(PhotometricError::OtherSize {
                what,
                width,
                height,
                expected_width: expected.0,
                expected_height: expected.1,
            });
        }
    }
    options.check()
}

impl EdgeOptions {
    fn check(&self) -> Result<(), PhotometricError> {
        let weak_is_less = f64::from(self.strong - self.weak);
        let numbers = [
            (
                "reach",
                self.reach,
                (1e-4..=0.02).contains(&self.reach),
                "0.0001 to 0.02 m",
            ),
            (
                "height",
                self.height,
                (-0.1..=0.5).contains(&self.height),
                "-0.1 to 0.5 m",
            ),
            (
                "strong",
                f64::from(self.strong),
                (0.0..=1.0).contains(&self.strong),
                "0 to 1",
            ),
            ("weak", f64::from(self.weak), (0.0..=1.0).contains(&self.weak), "0 to 1"),
            ("strong - weak", weak_is_less, weak_is_less >= 0.0, "numbers from 0"),
        ];
        match numbers.into_iter().find(|(_, _, is_allowed, _)| !is_allowed) {
            None => Ok(()),
            Some((what, value, _, allowed)) => Err(PhotometricError::OutOfRange { what, value, allowed }),
        }
    }
}
