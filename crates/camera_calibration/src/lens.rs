//! A camera as nine numbers, and how a pixel changes with each of them.

use geometry::{GeometryError, PinholeCamera, PlumbBob};
use nalgebra::{Matrix2x3, SMatrix, Vector2, Vector3};

/// Numbers of a camera.
pub(crate) const LENS: usize = 9;

/// Numbers of a camera that are fitted or fixed together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LensPart {
    /// fx and fy.
    Focal,
    /// cx and cy.
    Principal,
    /// k1.
    K1,
    /// k2.
    K2,
    /// p1 and p2.
    Tangential,
    /// k3: only wide angles need it, and others do not determine it.
    K3,
}

/// Which of a camera's numbers are not fitted: they keep what they start with. Without a start that is the image's middle
/// for cx and cy, and no distortion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedLens {
    mask: [bool; LENS],
}

impl Default for FixedLens {
    /// All but k3 are fitted.
    fn default() -> Self {
        Self::of(&[LensPart::K3])
    }
}

impl FixedLens {
    /// Nothing is fitted: the camera is known.
    pub(crate) const ALL: Self = Self { mask: [true; LENS] };

    /// These are fixed, the others fitted.
    pub fn of(parts: &[LensPart]) -> Self {
        let mut mask = [false; LENS];
        for part in parts {
            let numbers = match part {
                LensPart::Focal => 0..2,
                LensPart::Principal => 2..4,
                LensPart::K1 => 4..5,
                LensPart::K2 => 5..6,
                LensPart::Tangential => 6..8,
                LensPart::K3 => 8..9,
            };
            mask[numbers].fill(true);
        }
        Self { mask }
    }

    /// In the order of [`LensValues`].
    pub(crate) fn mask(&self) -> [bool; LENS] {
        self.mask
    }

    pub(crate) fn has_principal(&self) -> bool {
        self.mask[2]
    }
}

/// fx, fy, cx, cy, k1, k2, p1, p2, k3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LensValues(pub(crate) [f64; LENS]);

impl LensValues {
    pub(crate) fn of(camera: &PinholeCamera) -> Self {
        let ([fx, fy], [cx, cy], lens) = (camera.focal(), camera.principal(), camera.distortion());
        Self([fx, fy, cx, cy, lens.k1, lens.k2, lens.p1, lens.p2, lens.k3])
    }

    pub(crate) fn camera(&self, size: [usize; 2]) -> Result<PinholeCamera, GeometryError> {
        let [fx, fy, cx, cy, ..] = self.0;
        let camera = PinholeCamera::new(size[0], size[1], [fx, fy], [cx, cy])?;
        Ok(camera.with_distortion(self.distortion()))
    }

    fn distortion(&self) -> PlumbBob {
        let [_, _, _, _, k1, k2, p1, p2, k3] = self.0;
        PlumbBob { k1, k2, p1, p2, k3 }
    }

    /// The pixel of a point, and its derivatives by the camera's numbers and by the point; none behind the camera.
    pub(crate) fn project(&self, point: &Vector3<f64>) -> Option<Projected> {
        if point.z <= 1e-6 {
            return None;
        }
        let [fx, fy, cx, cy, ..] = self.0;
        let ideal = point.xy() / point.z;
        let (x, y) = (ideal.x, ideal.y);
        let r2 = ideal.norm_squared();
        let lens = self.distortion();
        let seen = lens.distort(ideal);
        let (xy, xx, yy) = (2.0 * x * y, r2 + 2.0 * x * x, r2 + 2.0 * y * y);
        let [r4, r6] = [r2 * r2, r2 * r2 * r2];
        let by_lens = SMatrix::<f64, 2, LENS>::from_row_slice(&[
            seen.x,
            0.0,
            1.0,
            0.0,
            fx * x * r2,
            fx * x * r4,
            fx * xy,
            fx * xx,
            fx * x * r6, //
            0.0,
            seen.y,
            0.0,
            1.0,
            fy * y * r2,
            fy * y * r4,
            fy * yy,
            fy * xy,
            fy * y * r6,
        ]);
        let slant = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / point.z;
        let by_ideal = nalgebra::Matrix2::from_diagonal(&Vector2::new(fx, fy)) * lens.jacobian(ideal);
        Some(Projected {
            pixel: Vector2::new(fx * seen.x + cx, fy * seen.y + cy),
            by_lens,
            by_point: by_ideal * slant,
        })
    }
}

/// A pixel and its derivatives.
pub(crate) struct Projected {
    pub(crate) pixel: Vector2<f64>,
    pub(crate) by_lens: SMatrix<f64, 2, LENS>,
    pub(crate) by_point: Matrix2x3<f64>,
}
