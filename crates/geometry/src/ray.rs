//! Rays and where they end.

use nalgebra::{Point3, Vector3};

/// A half line. Distances along it are multiples of `direction`, which need not have unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Point3<f64>,
    /// Where it goes.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// From one point through another, which lies at distance 1.
    pub fn between(from: &Point3<f64>, to: &Point3<f64>) -> Self {
        Self {
            origin: *from,
            direction: to - from,
        }
    }

    /// The point at a distance.
    pub fn at(&self, distance: f64) -> Point3<f64> {
        self.origin + self.direction * distance
    }
}

/// Where a ray meets a triangle, from either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Along the ray, in multiples of its direction; more than 0.
    pub distance: f64,
    /// Position of the triangle in its mesh.
    pub triangle: u32,
    /// Weights of the triangle's second and third corner; the first one's is what is missing from 1.
    pub barycentric: [f64; 2],
}
