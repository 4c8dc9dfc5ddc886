//! Light that each pixel sends to the camera. Edges are seen through many rays per pixel.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::block::{BLOCK, Block};
use super::direct::{Facing, Origin, Patch, ShadowRays, Shares, UNKNOWN, partly_known, shares};
use super::group::Group;
use super::indirect::Indirect;
use super::primary::Primary;
use super::random::{hash, unit};
use super::stage::{Place, Stage};
use crate::scene::Albedo;

/// L1 to L7, then the ambient light.
pub(super) const CHANNELS: usize = 8;
/// Which of them is the ambient light.
pub(super) const AMBIENT: usize = 7;

/// One number per channel.
pub(super) type Light = [f64; CHANNELS];

/// Albedo of dark surfaces: where the sensor's noise hides more than elsewhere.
pub(super) const DARK: f64 = 0.1;

/// Rays into a pixel with an edge: this many, squared.
pub(super) const EDGE_RAYS: usize = 4;
/// Rays into a pixel on a bent surface: this many, squared.
pub(super) const BENT_RAYS: usize = 2;
/// Where light is computed one point at a time.
const SHADOW_RAYS: ShadowRays = ShadowRays {
    rim: 8,
    few: 8,
    many: 64,
};
/// The same on dark surfaces.
const DARK_SHADOW_RAYS: ShadowRays = ShadowRays {
    rim: 8,
    few: 8,
    many: 40,
};
/// Where a pixel is one of many that bend, or has an edge.
const MIXED_SHADOW_RAYS: ShadowRays = ShadowRays {
    rim: 4,
    few: 4,
    many: 48,
};
/// In a small part of a pixel.
const SLIVER_SHADOW_RAYS: ShadowRays = ShadowRays {
    rim: 0,
    few: 4,
    many: 16,
};
/// What is a small part.
const SLIVER: f64 = 0.3;

/// Everything that is needed to shade a pixel.
pub(super) struct Shader<'a> {
    pub(super) primary: &'a Primary<'a>,
    pub(super) indirect: &'a Indirect,
    pub(super) seed: u64,
}

impl Shader<'_> {
    /// Radiance of all pixels.
    pub(super) fn shade(&self) -> Vec<[f32; CHANNELS]> {
        let width = self.primary.width;
        let mut radiance = vec![[0.0; CHANNELS]; width * self.primary.height];
        let bands = radiance.par_chunks_mut(BLOCK * width).enumerate();
        bands.for_each(|(band, rows)| {
            for x in (0..width).step_by(BLOCK) {
                Block::new(self, x, band * BLOCK).shade(rows);
            }
        });
        radiance
    }

    fn stage(&self) -> &Stage<'_> {
        self.primary.stage
    }

    /// All light that falls on a patch in a pixel.
    fn irradiance(&self, x: usize, y: usize, patch: &Patch<'_>, shares: &Shares, rays: ShadowRays) -> Light {
        let direct = partly_known(self.stage(), patch, shares, rays);
        let mut all = [0.0; CHANNELS];
        for Facing { point, normal } in patch.facings {
            accumulate(&mut all, &self.indirect.irradiance(x, y, point, normal), 1.0);
        }
        for (all, direct) in all.iter_mut().zip(direct) {
            *all += direct;
        }
        all
    }

    pub(super) fn irradiance_at(&self, x: usize, y: usize, place: &Place) -> Light {
        let patch = Patch {
            facings: &[Facing::of(place)],
            origins: &[Origin::of(place)],
            shift: [0.5; 2],
        };
        let dark = self.stage().albedo(place) < DARK;
        let rays = if dark { DARK_SHADOW_RAYS } else { SHADOW_RAYS };
        self.irradiance(x, y, &patch, &UNKNOWN, rays)
    }

    /// By panel, how much of its light above the horizon arrives at a place.
    pub(super) fn shares_at(&self, place: &Place) -> Shares {
        let patch = Patch {
            facings: &[Facing::of(place)],
            origins: &[Origin::of(place)],
            shift: [0.5; 2],
        };
        shares(self.stage(), &patch, SHADOW_RAYS)
    }

    /// What a place sends out of the light that falls on it.
    pub(super) fn reflected(&self, place: &Place, albedo: f64, irradiance: &Light) -> Light {
        let mut light = irradiance.map(|e| albedo / PI * e);
        if let Some((panel, radiance)) = self.stage().emission(place) {
            light[panel] += radiance;
        }
        light
    }

    /// Where nothing is seen there is only ambient light.
    pub(super) fn nothing(&self) -> Light {
        let mut light = [0.0; CHANNELS];
        light[AMBIENT] = self.stage().scene.ambient_radiance;
        light
    }

    /// Albedo of a pixel whose middle sees a place: printed patterns are finer than a pixel.
    pub(super) fn albedo(&self, x: usize, y: usize, place: &Place) -> f64 {
        let stage = self.stage();
        let body = stage.body(place.surface).map(|body| &stage.scene.bodies[body]);
        if !body.is_some_and(|body| matches!(body.albedo, Albedo::Print { .. })) {
            return stage.albedo(place);
        }
        let parts = grid(EDGE_RAYS).map(|offset| self.primary.inside(x, y, offset).unwrap_or(*place));
        parts.map(|part| stage.albedo(&part)).sum::<f64>() / (EDGE_RAYS * EDGE_RAYS) as f64
    }

    /// Light of a pixel in which more than one plane is seen.
    pub(super) fn mixed(&self, x: usize, y: usize, rays: usize, shares: &Shares) -> Light {
        let mut groups: Vec<Group> = Vec::with_capacity(4);
        let mut light = [0.0; CHANNELS];
        let share = 1.0 / (rays * rays) as f64;
        for offset in grid(rays) {
            match self.primary.inside(x, y, offset) {
                Some(place) => Group::add(&mut groups, self.stage(), place),
                None => accumulate(&mut light, &self.nothing(), share),
            }
        }
        let turn = hash(self.seed, &[x as u64, y as u64]);
        let shift = [unit(turn), unit(hash(turn, &[]))];
        for group in &mut groups {
            let part = share * group.count() as f64;
            let shadow_rays = if part < SLIVER {
                SLIVER_SHADOW_RAYS
            } else {
                MIXED_SHADOW_RAYS
            };
            let irradiance = self.irradiance(x, y, &group.patch(shift), shares, shadow_rays);
            let reflected = self.reflected(&group.first, group.albedo(), &irradiance);
            accumulate(&mut light, &reflected, part);
        }
        light
    }
}

/// Middles of the cells of a pixel divided into `side` x `side`, pixels from its middle.
fn grid(side: usize) -> impl Iterator<Item = [f64; 2]> {
    let along = move |i: usize| (i as f64 + 0.5) / side as f64 - 0.5;
    (0..side * side).map(move |i| [along(i % side), along(i / side)])
}

fn accumulate(sum: &mut Light, part: &Light, share: f64) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum += share * part;
    }
}
