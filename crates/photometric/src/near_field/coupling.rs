//! Neighbours help where a pixel's own samples say little.
//!
//! Every pixel keeps its own normal as firmly as its samples hold it (an inverse covariance) and is drawn towards its
//! neighbours, less the more they differ (Perona and Malik 1990, with the weight of Geman and `McClure` 1985), so that
//! folds stay folds.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::pixel::Estimate;
use super::pixels::Pixels;

/// Neighbours that differ by more than this belong to another face: three sigmas of a usual pixel, radians.
const FOLD: f32 = 0.10;
/// Sweeps over the pixels; what reaches further than twice so many pixels is not noise.
const SWEEPS: usize = 3;
/// A pixel whose samples say nothing still holds its normal so firmly.
const LEAST_FIRMNESS: f32 = 1e-2;

/// Normals after coupling. `strength` is the inverse variance of the difference between neighbours.
///
/// The pixels take turns like the fields of a chess board, so that each sees what its neighbours have just become (Gauss
/// and Seidel), whatever the number of threads.
pub(crate) fn couple(estimates: &[Estimate], pixels: &Pixels, strength: f32) -> Vec<Vec3> {
    let mut normals: Vec<Vec3> = estimates.iter().map(|estimate| estimate.normal).collect();
    let fields = [0, 1].map(|colour| Field::new(pixels, colour));
    for _ in 0..SWEEPS {
        for field in &fields {
            let moved = |place: &Place| place.moved(&estimates[place.slot as usize], &normals, strength);
            let moved: Vec<Vec3> = field.places.par_iter().with_min_len(1024).map(moved).collect();
            for (place, normal) in field.places.iter().zip(moved) {
                normals[place.slot as usize] = normal;
            }
        }
    }
    normals
}

/// The pixels of one colour of the chess board.
struct Field {
    places: Vec<Place>,
}

/// A pixel and its four neighbours; one that is missing is the pixel itself.
#[derive(Clone, Copy)]
struct Place {
    slot: u32,
    neighbours: [u32; 4],
}

impl Field {
    fn new(pixels: &Pixels, colour: usize) -> Self {
        let place = |(slot, &index): (usize, &u32)| {
            let (x, y) = pixels.place(index);
            ((x + y) % 2 == colour).then(|| Place {
                slot: slot as u32,
                neighbours: pixels
                    .neighbours(index)
                    .map(|neighbour| neighbour.unwrap_or(slot) as u32),
            })
        };
        let inside = pixels.inside.par_iter().enumerate().with_min_len(4096);
        Self {
            places: inside.filter_map(place).collect(),
        }
    }
}

impl Place {
    /// The pixel's normal anew, from its samples and its neighbours' present normals.
    #[inline]
    fn moved(&self, estimate: &Estimate, normals: &[Vec3], strength: f32) -> Vec3 {
        let normal = normals[self.slot as usize];
        let mut matrix = estimate.information + Mat3::from_diagonal(Vec3::splat(LEAST_FIRMNESS));
        let mut right = matrix * estimate.normal;
        let mut pulled = 0.0;
        for neighbour in self.neighbours.into_iter().filter(|&neighbour| neighbour != self.slot) {
            let other = normals[neighbour as usize];
            let apart = 1.0 + (other - normal).length_squared() * (1.0 / (FOLD * FOLD));
            let weight = strength / (apart * apart);
            // A neighbour without a normal is NaN, and so is its weight.
            if weight > 0.0 {
                pulled += weight;
                right += other * weight;
            }
        }
        matrix += Mat3::from_diagonal(Vec3::splat(pulled));
        direction(&matrix, right).unwrap_or(normal)
    }
}

/// The direction of a symmetric positive definite system's solution by Cramer's rule; none when it is singular.
#[inline]
fn direction(matrix: &Mat3, right: Vec3) -> Option<Vec3> {
    let across = matrix.y_axis.cross(matrix.z_axis);
    let determinant = matrix.x_axis.dot(across);
    let size = matrix.x_axis.x.max(matrix.y_axis.y).max(matrix.z_axis.z);
    let y = matrix.z_axis.cross(matrix.x_axis);
    let z = matrix.x_axis.cross(matrix.y_axis);
    let scaled = Vec3::new(across.dot(right), y.dot(right), z.dot(right)) * (1.0 / determinant);
    (determinant > 1e-12 * size * size * size)
        .then_some(scaled)
        .and_then(Vec3::try_normalize)
}
