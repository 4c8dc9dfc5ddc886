//! Normals worth a try: from every three lights as if they alone reached the pixel.

use glam::{Mat3, Vec3};

use super::lanes::{Lanes, VectorLanes};

/// Three lights and the matrix that turns their samples into a scaled normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triple {
    lights: [u8; 3],
    /// The same, bit by bit.
    mask: u8,
    inverse: Mat3,
}

/// Triples whose directions are closer to one plane than this amplify noise too much to be a start.
const LEAST_DETERMINANT: f32 = 0.03;

/// The usable triples among the first `count` lights.
pub(crate) fn triples(lights: &VectorLanes, count: usize) -> Vec<Triple> {
    let mut found = Vec::with_capacity(35);
    for a in 0..count {
        for b in a + 1..count {
            for c in b + 1..count {
                let rows = [a, b, c].map(|light| lights.get(light));
                let volume = rows[0].cross(rows[1]).dot(rows[2]);
                let size = rows[0].length() * rows[1].length() * rows[2].length();
                if volume.abs() > LEAST_DETERMINANT * size {
                    found.push(Triple {
                        lights: [a as u8, b as u8, c as u8],
                        mask: 1 << a | 1 << b | 1 << c,
                        inverse: Mat3::from_cols(rows[0], rows[1], rows[2]).transpose().inverse(),
                    });
                }
            }
        }
    }
    found
}

/// A light that gives less than this share of the brightest sample is taken to be in shadow.
const DIM: f32 = 0.04;

/// Lights bright enough to be hypotheses, bit by bit.
pub(crate) fn bright(signal: &Lanes, brightest: f32) -> u8 {
    signal.simd_gt(Lanes::splat(DIM * brightest)).to_bitmask() as u8
}

impl Triple {
    /// Whether all three lights are among some.
    #[inline]
    pub(crate) fn is_among(&self, lights: u8) -> bool {
        self.mask & !lights == 0
    }

    /// The scaled normal that gives these samples under the three lights.
    #[inline]
    pub(crate) fn scaled_normal(&self, signal: &Lanes) -> Vec3 {
        let [a, b, c] = self.lights.map(|light| signal.as_array()[usize::from(light)]);
        self.inverse * Vec3::new(a, b, c)
    }
}

/// Directions spread evenly over the upper part of the sphere, for pixels that three lights do not explain
/// (Fibonacci lattice: González, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices",
/// 2010).
pub(crate) fn directions(count: usize) -> Vec<Vec3> {
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let lowest = -0.3;
    (0..count)
        .map(|index| {
            let z = 1.0 - (1.0 - lowest) * (index as f32 + 0.5) / count as f32;
            let around = golden * index as f32;
            let radius = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(radius * around.cos(), radius * around.sin(), z)
        })
        .collect()
}
