//! Light between surfaces: what every patch sends out once all bounces have settled.
//!
//! Each patch looks around once, along an even pattern of rays, and remembers which patches it saw; light then goes to
//! and fro over these links, for all lights at the same time (Cohen and Wallace, "Radiosity and realistic image
//! synthesis", 1993, chapter 5, with form factors by rays).

use std::f64::consts::{PI, TAU};

use geometry::Ray;
use geometry::nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::chart::{Atlas, Patch as Piece};
use super::direct::{Origin, Patch, ShadowRays, direct_light};
use super::random::{evenly, hash, unit};
use super::shade::{AMBIENT, CHANNELS};
use super::stage::Stage;

/// One number per channel: radiant exitance, π times the radiance of a Lambertian surface.
pub(super) type Exitance = [f32; CHANNELS];

/// Rays with which a patch looks around: so many for all patches together, between these for each.
const RAYS_OF_ALL: usize = 1_000_000;
const RAYS: [usize; 2] = [16, 64];
/// Times that light goes from patch to patch. The brightest surfaces reflect 85 % of what is mostly absorbed elsewhere.
const BOUNCES: usize = 5;
/// Rays that look for the shadow of a panel on a patch.
const SHADOW_RAYS: ShadowRays = ShadowRays {
    rim: 0,
    few: 6,
    many: 18,
};
/// A ray that ended on nothing: it sees the ambient light.
const OPEN: u32 = u32::MAX;
/// A ray that ended on something black.
const BLACK: u32 = u32::MAX - 1;

/// Light that all patches send out.
pub(super) struct Radiosity {
    atlas: Atlas,
    exitance: Vec<Exitance>,
    open: Exitance,
}

/// What a ray found.
pub(super) struct Sight {
    pub(super) exitance: Exitance,
    /// Metres; infinite where it found nothing.
    pub(super) distance: f64,
}

impl Radiosity {
    pub(super) fn new(stage: &Stage<'_>, seed: u64) -> Self {
        let atlas = Atlas::new(stage);
        let mut open = [0.0; CHANNELS];
        open[AMBIENT] = (PI * stage.scene.ambient_radiance) as f32;
        let direct: Vec<Exitance> = atlas.patches.par_iter().map(|patch| direct(stage, patch)).collect();
        let rays = (RAYS_OF_ALL / atlas.patches.len().max(1)).clamp(RAYS[0], RAYS[1]);
        let numbered = atlas.patches.par_iter().enumerate();
        let seen: Vec<Vec<u32>> = numbered
            .map(|(index, patch)| look_around(stage, &atlas, patch, rays, hash(seed, &[index as u64])))
            .collect();
        let mut exitance = reflect(&atlas, &direct);
        for _ in 0..BOUNCES {
            let arriving = |(seen, direct): (&Vec<u32>, &Exitance)| arriving(seen, direct, &exitance, &open);
            let irradiance: Vec<Exitance> = seen.par_iter().zip(&direct).map(arriving).collect();
            exitance = reflect(&atlas, &irradiance);
        }
        Self { atlas, exitance, open }
    }

    /// What is seen along a ray of unit direction.
    pub(super) fn look(&self, stage: &Stage<'_>, ray: &Ray) -> Sight {
        let Some(place) = stage.closest(ray) else {
            return Sight {
                exitance: self.open,
                distance: f64::INFINITY,
            };
        };
        let patch = self.atlas.patch(&place);
        Sight {
            exitance: patch.map_or([0.0; CHANNELS], |patch| self.exitance[patch as usize]),
            distance: place.distance,
        }
    }
}

/// Light straight from the panels.
fn direct(stage: &Stage<'_>, piece: &Piece) -> Exitance {
    let mut sum = [0.0; CHANNELS];
    for spot in &piece.spots {
        let patch = Patch {
            facings: &[spot.facing()],
            origins: &[*spot],
            shift: [0.5; 2],
        };
        let light = direct_light(stage, &patch, SHADOW_RAYS);
        for (sum, light) in sum.iter_mut().zip(light) {
            *sum += (light / piece.spots.len() as f64) as f32;
        }
    }
    sum
}

/// The patches that a patch sees, by rays that are as dense as the cosine of their angle.
fn look_around(stage: &Stage<'_>, atlas: &Atlas, piece: &Piece, rays: usize, turn: u64) -> Vec<u32> {
    if piece.spots.is_empty() {
        return Vec::new();
    }
    let shift = [unit(turn), unit(hash(turn, &[]))];
    let look = |index: usize| {
        let Origin { point, normal } = piece.spots[index % piece.spots.len()];
        let ray = cosine_ray(&point, &normal, evenly(index, shift));
        match stage.closest(&ray) {
            None => OPEN,
            Some(place) => atlas.patch(&place).unwrap_or(BLACK),
        }
    };
    (0..rays).map(look).collect()
}

fn arriving(seen: &[u32], direct: &Exitance, exitance: &[Exitance], open: &Exitance) -> Exitance {
    let mut sum = [0.0; CHANNELS];
    for &patch in seen {
        let light = match patch {
            OPEN => open,
            BLACK => continue,
            patch => &exitance[patch as usize],
        };
        for (sum, light) in sum.iter_mut().zip(light) {
            *sum += light;
        }
    }
    let share = 1.0 / seen.len().max(1) as f32;
    std::array::from_fn(|channel| direct[channel] + share * sum[channel])
}

fn reflect(atlas: &Atlas, irradiance: &[Exitance]) -> Vec<Exitance> {
    let pairs = atlas.patches.iter().zip(irradiance);
    pairs
        .map(|(patch, light)| light.map(|e| e * patch.albedo as f32))
        .collect()
}

/// A ray over a surface; evenly spread numbers make rays that are as dense as the cosine of their angle to the normal.
pub(super) fn cosine_ray(origin: &Point3<f64>, normal: &Vector3<f64>, [radius, turn]: [f64; 2]) -> Ray {
    let side = if normal.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let right = normal.cross(&side).normalize();
    let up = normal.cross(&right);
    let (sin, cos) = (TAU * turn).sin_cos();
    let out = radius.sqrt();
    Ray {
        origin: *origin,
        direction: right * (out * cos) + up * (out * sin) + normal * (1.0 - radius).max(1e-9).sqrt(),
    }
}
