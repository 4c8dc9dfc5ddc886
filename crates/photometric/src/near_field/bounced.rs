//! Light that an object throws on itself.
//!
//! A matte surface sends the same radiance everywhere, so the images say already what every part of it throws: no
//! bounces have to be followed. A patch j seen by the camera gives a patch i that it faces the irradiance
//!
//! ```text
//! E_i = Σ_j B_j cos θ_i cos θ_j A_j / (π r² + A_j)          B_j = reflectance · signal_j / gain
//! ```
//!
//! (Cohen and Greenberg, "The hemi-cube", 1985, with the form factor of a disc for the near ones.) What lies hidden
//! between two patches is not looked for, and what the camera does not see throws nothing.

use glam::Vec3;
use imaging::Image;
use rayon::prelude::*;

use super::lanes::Lanes;
use super::pixel::Estimate;
use super::pixels::Pixels;
use super::samples::Samples;

/// Most patches; their pairs are gone through.
const MOST_PATCHES: usize = 1000;
/// Smallest side of a patch, pixels.
const LEAST_SIDE: usize = 3;
/// Pixels of a patch whose normals differ so that their mean is shorter than this lie on several faces.
const LEAST_AGREEMENT: f32 = 0.7;
/// A surface seen more slantingly than this counts as seen so: cosine.
const LEAST_FACING: f32 = 0.15;

/// Irradiance by way of the object, on a grid of patches.
pub(crate) struct BouncedLight {
    side: usize,
    columns: usize,
    rows: usize,
    /// None where there is no patch.
    values: Vec<Option<Lanes>>,
}

/// A piece of the surface.
#[derive(Clone, Copy)]
struct Patch {
    place: usize,
    point: Vec3,
    normal: Vec3,
    area: f32,
    /// Radiosity under each light.
    thrown: Lanes,
}

/// Sums over the pixels of a patch.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f32,
    point: Vec3,
    normal: Vec3,
    area: f32,
    signal: Lanes,
}

impl BouncedLight {
    /// From solved pixels with a depth (metres); `gain` turns digital numbers into irradiance times albedo.
    pub(crate) fn new(
        samples: &Samples<'_>,
        pixels: &Pixels,
        estimates: &[Estimate],
        depth: &Image<f32>,
        gain: f32,
        reflectance: f32,
    ) -> Self {
        let side = (((pixels.inside.len() / MOST_PATCHES) as f32).sqrt().ceil() as usize).max(LEAST_SIDE);
        let (columns, rows) = (pixels.width.div_ceil(side), pixels.height.div_ceil(side));
        let mut sums = vec![Sums::default(); columns * rows];
        for (&index, estimate) in pixels.inside.iter().zip(estimates) {
            let (x, y) = pixels.place(index);
            if let Some(own) = Sums::of(samples, index as usize, estimate, depth, gain) {
                sums[y / side * columns + x / side].add(&own);
            }
        }
        let patches: Vec<Patch> = sums
            .iter()
            .enumerate()
            .filter_map(|(place, sums)| sums.patch(place, reflectance))
            .collect();
        let mut values = vec![None; columns * rows];
        let received: Vec<Lanes> = patches
            .par_iter()
            .with_min_len(8)
            .map(|patch| patch.receive(&patches))
            .collect();
        for (patch, light) in patches.iter().zip(received) {
            values[patch.place] = Some(light);
        }
        Self {
            side,
            columns,
            rows,
            values,
        }
    }

    /// At a pixel of an image `scale` times as large as the one it was made from; between patches bilinear over those
    /// that are there.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize, scale: usize) -> Lanes {
        let side = (self.side * scale) as f32;
        let (u, v) = ((x as f32 + 0.5) / side - 0.5, (y as f32 + 0.5) / side - 0.5);
        let (left, top) = (u.floor(), v.floor());
        let (right, down) = (u - left, v - top);
        let (mut light, mut total) = (Lanes::ZERO, 0.0);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let weight = (1.0 - (right - dx).abs()) * (1.0 - (down - dy).abs());
            let (column, row) = (left + dx, top + dy);
            let is_inside =
                column >= 0.0 && row >= 0.0 && (column as usize) < self.columns && (row as usize) < self.rows;
            if !is_inside {
                continue;
            }
            if let Some(value) = self.values[row as usize * self.columns + column as usize] {
                light += value * weight;
                total += weight;
            }
        }
        if total > 0.0 {
            light * (1.0 / total)
        } else {
            Lanes::ZERO
        }
    }
}

impl Sums {
    fn of(samples: &Samples<'_>, index: usize, estimate: &Estimate, depth: &Image<f32>, gain: f32) -> Option<Self> {
        let depth = depth.pixels()[index];
        let pixel = samples
            .pixel(index, gain)
            .filter(|_| depth.is_finite() && estimate.normal.is_finite())?;
        let facing = estimate.normal.dot(pixel.to_camera).max(LEAST_FACING);
        Some(Self {
            count: 1.0,
            point: samples.point(index, depth),
            normal: estimate.normal,
            area: samples.pixel_area(depth) / facing,
            signal: pixel.signal * pixel.valid,
        })
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.point += other.point;
        self.normal += other.normal;
        self.area += other.area;
        self.signal += other.signal;
    }

    fn patch(&self, place: usize, reflectance: f32) -> Option<Patch> {
        let normal = self.normal / self.count;
        (self.count > 0.0 && normal.length() > LEAST_AGREEMENT).then(|| Patch {
            place,
            point: self.point / self.count,
            normal: normal.normalize(),
            area: self.area,
            thrown: self.signal * (reflectance / self.count),
        })
    }
}

impl Patch {
    fn receive(&self, all: &[Self]) -> Lanes {
        let mut light = Lanes::ZERO;
        for other in all {
            let to = other.point - self.point;
            let (here, there) = (self.normal.dot(to), -other.normal.dot(to));
            if here <= 0.0 || there <= 0.0 {
                continue;
            }
            let square = to.length_squared();
            let factor = here * there / square * other.area / (std::f32::consts::PI * square + other.area);
            light += other.thrown * factor;
        }
        light
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(point: [f32; 3], normal: [f32; 3], area: f32, thrown: f32) -> Patch {
        Patch {
            place: 0,
            point: point.into(),
            normal: normal.into(),
            area,
            thrown: Lanes::splat(thrown),
        }
    }

    #[test]
    fn a_wall_beside_a_floor_gives_what_its_form_factor_says() {
        // A wall from the floor to height 1, so long that its ends do not matter, of radiosity 1.
        let step = 0.025;
        let wall: Vec<Patch> = (0..40)
            .flat_map(|row| (-1200..1200).map(move |column| (row, column)))
            .map(|(row, column)| {
                let at = |n: i32| (n as f32 + 0.5) * step;
                patch([0.0, at(column), at(row)], [1.0, 0.0, 0.0], step * step, 1.0)
            })
            .collect();
        for x in [0.2_f32, 0.5, 1.0, 3.0] {
            let floor = patch([x, 0.0, 0.0], [0.0, 0.0, 1.0], 1e-4, 0.0);
            let found = floor.receive(&wall).as_array()[3];
            // Howell's catalogue of configuration factors, a strip at a right angle.
            let exact = 0.5 * (1.0 - x / (x * x + 1.0).sqrt());
            assert!((found / exact - 1.0).abs() < 0.03, "at {x}: {found}, exact {exact}");
        }
    }

    #[test]
    fn what_bulges_outward_gives_itself_nothing() {
        let around = |k: i32| (k as f32 * 0.1).sin_cos();
        let ball: Vec<Patch> = (0..60)
            .map(|k| {
                patch(
                    [around(k).0, around(k).1, 0.0],
                    [around(k).0, around(k).1, 0.0],
                    0.01,
                    1.0,
                )
            })
            .collect();
        for one in &ball {
            assert!(one.receive(&ball).reduce_add() < 1e-6);
        }
    }
}
