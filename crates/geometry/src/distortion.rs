//! Lens distortion of the `plumb_bob` model (Brown 1966; coefficients in the order `OpenCV` and ROS use).
//!
//! With `r² = x² + y²` on the plane z = 1:
//! ```text
//! x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
//! y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
//! ```

use nalgebra::{Matrix2, Vector2};

/// Newton steps before a pixel is given up; real lenses need three to five.
const MAX_ITERATIONS: usize = 25;

/// The five coefficients; all zero is a perfect lens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlumbBob {
    /// Radial, r².
    pub k1: f64,
    /// Radial, r⁴.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial, r⁶.
    pub k3: f64,
}

/// The end of a search for an undistorted position.
pub(crate) struct Undistorted {
    pub(crate) ideal: Vector2<f64>,
    /// Distance left on the plane z = 1.
    pub(crate) residual: f64,
    pub(crate) iterations: usize,
    /// False where the distortion has folded over, so that another ray also lands here.
    pub(crate) orientation_kept: bool,
}

impl PlumbBob {
    /// True when the lens distorts nothing.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Where the lens puts an ideal position on the plane z = 1.
    pub fn distort(&self, ideal: Vector2<f64>) -> Vector2<f64> {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = ideal.norm_squared();
        let radial = self.radial(r2);
        Vector2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    /// Derivative of [`Self::distort`].
    pub fn jacobian(&self, ideal: Vector2<f64>) -> Matrix2<f64> {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = ideal.norm_squared();
        let radial = self.radial(r2);
        let slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + 3.0 * self.k3 * r2));
        let mixed = x * y * slope + 2.0 * (self.p1 * x + self.p2 * y);
        Matrix2::new(
            radial + x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            mixed,
            mixed,
            radial + y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
    }

    fn radial(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
    }

    /// Newton's method on `distort(ideal) = distorted`, started at the distorted position.
    pub(crate) fn undistort(&self, distorted: Vector2<f64>, tolerance: f64) -> Undistorted {
        let mut ideal = distorted;
        let mut iterations = 0;
        loop {
            let error = distorted - self.distort(ideal);
            let jacobian = self.jacobian(ideal);
            let residual = error.norm();
            let step = jacobian.try_inverse().map(|inverse| inverse * error);
            match step {
                Some(step) if residual > tolerance && iterations < MAX_ITERATIONS => ideal += step,
                _ => {
                    let orientation_kept = jacobian.determinant() > 0.0 && jacobian.trace() > 0.0;
                    return Undistorted {
                        ideal,
                        residual,
                        iterations,
                        orientation_kept,
                    };
                }
            }
            iterations += 1;
        }
    }
}
