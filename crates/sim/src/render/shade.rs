//! Light that each pixel sends to the camera.
//!
//! Where a block of pixels lies in one plane, light is computed at few of them and interpolated between; edges are seen
//! through many rays per pixel.

use std::f64::consts::PI;

use geometry::nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::direct::{Patch, ShadowRays, direct_light};
use super::indirect::Indirect;
use super::primary::{Primary, Surrounding};
use super::random::{hash, unit};
use super::stage::{Place, Stage};
use crate::scene::Albedo;

/// L1 to L7, then the ambient light.
pub(super) const CHANNELS: usize = 8;
/// Which of them is the ambient light.
pub(super) const AMBIENT: usize = 7;

/// One number per channel.
pub(super) type Light = [f64; CHANNELS];

/// Side of the largest block that is interpolated, pixels.
const BLOCK: usize = 8;
/// Light may differ by this share of the brightest panel's from what interpolation says.
const TOLERANCE: f64 = 0.02;
/// Rays into a pixel with an edge: this many, squared.
const EDGE_RAYS: usize = 4;
/// Rays into a pixel on a bent surface: this many, squared.
const BENT_RAYS: usize = 2;
/// Parts of a pixel on one body belong together up to this cosine between their normals.
const GROUP_COSINE: f64 = 0.95;

/// Where light is computed one point at a time.
const SHADOW_RAYS: ShadowRays = ShadowRays { few: 8, many: 64 };
/// Where a pixel is one of many that bend.
const BENT_SHADOW_RAYS: ShadowRays = ShadowRays { few: 6, many: 32 };

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
    fn irradiance(&self, x: usize, y: usize, patch: &Patch<'_>, rays: ShadowRays) -> Light {
        let direct = direct_light(self.stage(), patch, rays);
        let mut all = self.indirect.irradiance(x, y, &patch.point, &patch.normal);
        for (all, direct) in all.iter_mut().zip(direct) {
            *all += direct;
        }
        all
    }

    fn irradiance_at(&self, x: usize, y: usize, place: &Place) -> Light {
        let patch = Patch {
            point: place.point,
            normal: place.normal,
            origins: &[place.lifted()],
            shift: [0.5; 2],
        };
        self.irradiance(x, y, &patch, SHADOW_RAYS)
    }

    /// What a place sends out of the light that falls on it.
    fn reflected(&self, place: &Place, albedo: f64, irradiance: &Light) -> Light {
        let mut light = irradiance.map(|e| albedo / PI * e);
        if let Some((panel, radiance)) = self.stage().emission(place) {
            light[panel] += radiance;
        }
        light
    }

    /// Where nothing is seen there is only ambient light.
    fn nothing(&self) -> Light {
        let mut light = [0.0; CHANNELS];
        light[AMBIENT] = self.stage().scene.ambient_radiance;
        light
    }

    /// Albedo of a pixel whose middle sees a place: printed patterns are finer than a pixel.
    fn albedo(&self, x: usize, y: usize, place: &Place) -> f64 {
        let stage = self.stage();
        let body = stage.body(place.surface).map(|body| &stage.scene.bodies[body]);
        if !body.is_some_and(|body| matches!(body.albedo, Albedo::Print { .. })) {
            return stage.albedo(place);
        }
        let parts = grid(EDGE_RAYS).map(|offset| self.primary.inside(x, y, offset).unwrap_or(*place));
        parts.map(|part| stage.albedo(&part)).sum::<f64>() / (EDGE_RAYS * EDGE_RAYS) as f64
    }

    /// Light of a pixel in which more than one plane is seen.
    fn mixed(&self, x: usize, y: usize, rays: usize) -> Light {
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
        let shadow_rays = if rays == EDGE_RAYS {
            SHADOW_RAYS
        } else {
            BENT_SHADOW_RAYS
        };
        for group in &groups {
            let patch = group.patch(shift);
            let reflected = self.reflected(
                &group.first,
                group.albedo(),
                &self.irradiance(x, y, &patch, shadow_rays),
            );
            accumulate(&mut light, &reflected, share * group.count() as f64);
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

/// Parts of a pixel that face about the same way.
struct Group {
    first: Place,
    points: Vector3<f64>,
    normals: Vector3<f64>,
    albedos: f64,
    origins: Vec<Point3<f64>>,
}

impl Group {
    fn add(groups: &mut Vec<Self>, stage: &Stage<'_>, place: Place) {
        let together = |group: &&mut Self| {
            let same = match stage.body(place.surface) {
                Some(body) => stage.body(group.first.surface) == Some(body),
                None => group.first.surface == place.surface,
            };
            same && group.first.normal.dot(&place.normal) > GROUP_COSINE
        };
        let albedo = stage.albedo(&place);
        if let Some(group) = groups.iter_mut().find(together) {
            group.points += place.point.coords;
            group.normals += place.normal;
            group.albedos += albedo;
            group.origins.push(place.lifted());
            return;
        }
        groups.push(Self {
            first: place,
            points: place.point.coords,
            normals: place.normal,
            albedos: albedo,
            origins: vec![place.lifted()],
        });
    }

    fn count(&self) -> usize {
        self.origins.len()
    }

    fn albedo(&self) -> f64 {
        self.albedos / self.count() as f64
    }

    fn patch(&self, shift: [f64; 2]) -> Patch<'_> {
        Patch {
            point: Point3::from(self.points / self.count() as f64),
            normal: self.normals / self.count() as f64,
            origins: &self.origins,
            shift,
        }
    }
}

/// A square of pixels; on its way it remembers what was computed.
struct Block<'a> {
    shader: &'a Shader<'a>,
    left: usize,
    top: usize,
    known: [Option<Light>; BLOCK * BLOCK],
}

impl<'a> Block<'a> {
    fn new(shader: &'a Shader<'a>, left: usize, top: usize) -> Self {
        Self {
            shader,
            left,
            top,
            known: [None; BLOCK * BLOCK],
        }
    }

    /// Shades its pixels; `rows` are the image's rows from the block's top.
    fn shade(&mut self, rows: &mut [[f32; CHANNELS]]) {
        self.part(0, 0, BLOCK, rows);
    }

    fn part(&mut self, x: usize, y: usize, side: usize, rows: &mut [[f32; CHANNELS]]) {
        let primary = self.shader.primary;
        if self.left + x >= primary.width || self.top + y >= primary.height {
            return;
        }
        if side == 1 {
            let light = self.pixel(x, y);
            self.put(x, y, &light, rows);
        } else if side == 2 || !self.flat(x, y, side) || !self.interpolate(x, y, side, rows) {
            let half = side / 2;
            for (right, down) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.part(x + right, y + down, half, rows);
            }
        }
    }

    fn put(&self, x: usize, y: usize, light: &Light, rows: &mut [[f32; CHANNELS]]) {
        rows[y * self.shader.primary.width + self.left + x] = light.map(|value| value as f32);
    }

    /// Light of one pixel by itself.
    fn pixel(&mut self, x: usize, y: usize) -> Light {
        let (column, row) = (self.left + x, self.top + y);
        let shader = self.shader;
        match (
            shader.primary.surrounding(column, row),
            shader.primary.place(column, row),
        ) {
            (Surrounding::Flat, Some(place)) => {
                let irradiance = self.irradiance(x, y, &place);
                shader.reflected(&place, shader.albedo(column, row, &place), &irradiance)
            }
            (Surrounding::Flat, None) => shader.nothing(),
            (Surrounding::Bent, _) => shader.mixed(column, row, BENT_RAYS),
            (Surrounding::Edge, _) => shader.mixed(column, row, EDGE_RAYS),
        }
    }

    fn irradiance(&mut self, x: usize, y: usize, place: &Place) -> Light {
        let shader = self.shader;
        *self.known[y * BLOCK + x].get_or_insert_with(|| shader.irradiance_at(self.left + x, self.top + y, place))
    }

    /// Whether a part lies inside the image and in one plane, without an edge.
    fn flat(&self, x: usize, y: usize, side: usize) -> bool {
        let primary = self.shader.primary;
        let (left, top) = (self.left + x, self.top + y);
        if left + side > primary.width || top + side > primary.height {
            return false;
        }
        let plane = primary.plane(left, top);
        let mut pixels = (0..side * side).map(|i| (left + i % side, top + i / side));
        pixels.all(|(x, y)| primary.plane(x, y) == plane && primary.surrounding(x, y) == Surrounding::Flat)
    }

    /// Shades a flat part from its corners unless its middle shows that there is more to see.
    fn interpolate(&mut self, x: usize, y: usize, side: usize, rows: &mut [[f32; CHANNELS]]) -> bool {
        let far = side - 1;
        let spots = [
            (x, y),
            (x + far, y),
            (x, y + far),
            (x + far, y + far),
            (x + side / 2, y + side / 2),
        ];
        let mut lights = [[0.0; CHANNELS]; 5];
        for (light, (x, y)) in lights.iter_mut().zip(spots) {
            let Some(place) = self.shader.primary.place(self.left + x, self.top + y) else {
                return false;
            };
            *light = self.irradiance(x, y, &place);
        }
        let [corner_1, corner_2, corner_3, corner_4, middle] = lights;
        let corners = [corner_1, corner_2, corner_3, corner_4];
        let at_middle = (side / 2) as f64 / far as f64;
        if !agree(&between(&corners, at_middle, at_middle), &middle, &corners) {
            return false;
        }
        for (down, right) in (0..side * side).map(|i| (i / side, i % side)) {
            let irradiance = between(&corners, right as f64 / far as f64, down as f64 / far as f64);
            let (column, row) = (self.left + x + right, self.top + y + down);
            if let Some(place) = self.shader.primary.place(column, row) {
                let albedo = self.shader.albedo(column, row, &place);
                self.put(
                    x + right,
                    y + down,
                    &self.shader.reflected(&place, albedo, &irradiance),
                    rows,
                );
            }
        }
        true
    }
}

/// Bilinear interpolation.
fn between([a, b, c, d]: &[Light; 4], right: f64, down: f64) -> Light {
    std::array::from_fn(|channel| {
        let upper = a[channel] + (b[channel] - a[channel]) * right;
        let lower = c[channel] + (d[channel] - c[channel]) * right;
        upper + (lower - upper) * down
    })
}

/// Whether light in the middle is what its surroundings let expect.
fn agree(expected: &Light, found: &Light, corners: &[Light; 4]) -> bool {
    let brightest = corners.iter().flatten().fold(0.0, |a: f64, &b| a.max(b));
    expected
        .iter()
        .zip(found)
        .all(|(a, b)| (a - b).abs() <= TOLERANCE * brightest)
}
