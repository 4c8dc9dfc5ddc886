//! What each pixel sees.

use geometry::nalgebra::Point2;
use geometry::{GeometryError, Ray};
use rayon::prelude::*;

use super::stage::{NOTHING, Place, Stage};
use crate::scene::View;

/// Normals of neighbouring pixels on a smooth surface differ by less than this cosine.
const SMOOTH_COSINE: f64 = 0.87;
/// A neighbour's depth on the same surface differs by less than this many pixels' width.
const SMOOTH_STEP_PX: f64 = 4.0;

/// What the middle of a pixel sees.
#[derive(Debug, Clone, Copy)]
struct Sample {
    surface: u32,
    depth: f32,
}

/// How a pixel differs from its neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Surrounding {
    /// All of them lie in one plane.
    Flat,
    /// They lie on one bent surface.
    Bent,
    /// An edge passes.
    Edge,
}

/// What every pixel sees.
pub(super) struct Primary<'a> {
    pub(super) stage: &'a Stage<'a>,
    view: &'a View,
    pub(super) width: usize,
    pub(super) height: usize,
    samples: Vec<Sample>,
    surroundings: Vec<Surrounding>,
}

impl<'a> Primary<'a> {
    pub(super) fn new(stage: &'a Stage<'a>, view: &'a View) -> Result<Self, GeometryError> {
        let (width, height) = (view.camera.width(), view.camera.height());
        let pixel = |index: usize| {
            let ray = ray(view, [(index % width) as f64, (index / width) as f64])?;
            Ok(stage.closest(&ray).map_or(
                Sample {
                    surface: NOTHING,
                    depth: f32::NAN,
                },
                |place| Sample {
                    surface: place.surface,
                    depth: place.distance as f32,
                },
            ))
        };
        let samples = (0..width * height).into_par_iter().with_min_len(width).map(pixel);
        let mut primary = Self {
            stage,
            view,
            width,
            height,
            samples: samples.collect::<Result<_, GeometryError>>()?,
            surroundings: Vec::new(),
        };
        let pixels = (0..width * height).into_par_iter().with_min_len(width);
        let surroundings = pixels.map(|index| primary.look_around(index % width, index / width));
        primary.surroundings = surroundings.collect();
        Ok(primary)
    }

    /// Focal length, pixels.
    pub(super) fn focal(&self) -> f64 {
        self.view.camera.focal()[0]
    }

    /// What the middle of a pixel sees.
    pub(super) fn place(&self, x: usize, y: usize) -> Option<Place> {
        let sample = self.samples[y * self.width + x];
        if sample.surface == NOTHING {
            return None;
        }
        let ray = ray(self.view, [x as f64, y as f64]).ok()?;
        Some(self.stage.place(&ray, f64::from(sample.depth), sample.surface))
    }

    /// What a place in a pixel sees; offsets are pixels from its middle.
    pub(super) fn inside(&self, x: usize, y: usize, offset: [f64; 2]) -> Option<Place> {
        // Every middle has a ray; where the lens folds over before a pixel's border, the middle stands for it.
        let at = [x as f64 + offset[0], y as f64 + offset[1]];
        let ray = ray(self.view, at).or_else(|_| ray(self.view, [x as f64, y as f64]));
        self.stage.closest(&ray.ok()?)
    }

    /// The number of the plane a pixel's middle sees.
    pub(super) fn plane(&self, x: usize, y: usize) -> u32 {
        match self.samples[y * self.width + x].surface {
            NOTHING => NOTHING,
            surface => self.stage.plane(surface),
        }
    }

    /// The body a pixel's middle sees.
    pub(super) fn body(&self, x: usize, y: usize) -> Option<usize> {
        self.stage.body(self.samples[y * self.width + x].surface)
    }

    /// Metres along the optical axis; NaN where nothing is seen.
    pub(super) fn depth(&self, x: usize, y: usize) -> f32 {
        self.samples[y * self.width + x].depth
    }

    /// How a pixel differs from its neighbours.
    pub(super) fn surrounding(&self, x: usize, y: usize) -> Surrounding {
        self.surroundings[y * self.width + x]
    }

    fn look_around(&self, x: usize, y: usize) -> Surrounding {
        let plane = self.plane(x, y);
        let mut found = Surrounding::Flat;
        for near_y in y.saturating_sub(1)..(y + 2).min(self.height) {
            for near_x in x.saturating_sub(1)..(x + 2).min(self.width) {
                if self.plane(near_x, near_y) == plane {
                    continue;
                }
                if !self.smooth([x, y], [near_x, near_y]) {
                    return Surrounding::Edge;
                }
                found = Surrounding::Bent;
            }
        }
        found
    }

    /// Whether two neighbours lie on one body without a step or a crease between them.
    fn smooth(&self, [x, y]: [usize; 2], [near_x, near_y]: [usize; 2]) -> bool {
        let sample = |x: usize, y: usize| self.samples[y * self.width + x];
        let (here, there) = (sample(x, y), sample(near_x, near_y));
        let facet = |sample: Sample| self.stage.facets.get(sample.surface as usize);
        let (Some(one), Some(other)) = (facet(here), facet(there)) else {
            return false;
        };
        let step = f64::from(here.depth - there.depth).abs();
        let pixel = f64::from(here.depth) / self.focal();
        one.body == other.body && one.normal.dot(&other.normal) > SMOOTH_COSINE && step < SMOOTH_STEP_PX * pixel
    }
}

/// The ray through a position in the image, base frame; distances along it are depths.
fn ray(view: &View, pixel: [f64; 2]) -> Result<Ray, GeometryError> {
    let direction = view.camera.unproject(&Point2::from(pixel))?;
    Ok(Ray {
        origin: view.base_from_camera.translation().into(),
        direction: view.base_from_camera.transform_direction(&direction),
    })
}
