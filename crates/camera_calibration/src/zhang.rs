//! The camera matrix in closed form.
//!
//! Zhang 2000, "A flexible new technique for camera calibration", IEEE T-PAMI 22(11), section 3.1, without skew: every
//! homography `H = [h1 h2 h3]` gives `h1ᵀ B h2 = 0` and `h1ᵀ B h1 = h2ᵀ B h2` (equations 3 and 4), with
//! `B = K⁻ᵀ K⁻¹`, of which the rest follows (appendix B).

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2};

use crate::homography::sorted_eigen;

/// A focal length below this part of the image's side is a wide angle no such lens has, above its inverse no lens.
const LEAST_FOCAL: f64 = 0.1;
/// The principal point is within this part of the image's side from the middle.
const OFF_CENTRE: f64 = 0.35;

/// Focal lengths and principal point, pixels; none when the views do not tell.
pub(crate) fn camera_matrix(homographies: &[Matrix3<f64>], size: [usize; 2]) -> Option<([f64; 2], [f64; 2])> {
    let [width, height] = size.map(|side| side as f64);
    let unit = 0.5 * (width + height);
    let middle = Vector2::new(0.5 * (width - 1.0), 0.5 * (height - 1.0));
    let to_unit = Matrix3::new(1.0, 0.0, -middle.x, 0.0, 1.0, -middle.y, 0.0, 0.0, unit) / unit;
    let scaled: Vec<Matrix3<f64>> = homographies
        .iter()
        .map(|homography| to_unit * homography)
        .map(|homography| homography / homography.fixed_columns::<2>(0).norm())
        .collect();
    let (focal, off) = with_principal_point(&scaled).or_else(|| centred(&scaled))?;
    let principal = middle + off * unit;
    Some(([focal.x * unit, focal.y * unit], principal.into()))
}

fn is_lens(focal: &Vector2<f64>) -> bool {
    focal.iter().all(|f| (LEAST_FOCAL..=1.0 / LEAST_FOCAL).contains(f))
}

/// All four numbers.
fn with_principal_point(homographies: &[Matrix3<f64>]) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let mut square = SMatrix::<f64, 5, 5>::zeros();
    for homography in homographies {
        let row = |i: usize, j: usize| {
            let (a, b) = (homography.column(i), homography.column(j));
            SMatrix::<f64, 1, 5>::from([
                a.x * b.x,
                a.y * b.y,
                a.x * b.z + a.z * b.x,
                a.y * b.z + a.z * b.y,
                a.z * b.z,
            ])
        };
        for row in [row(0, 1), row(0, 0) - row(1, 1)] {
            square += row.transpose() * row;
        }
    }
    let (_, vectors) = sorted_eigen(&square);
    let [b11, b22, b13, b23, b33] = vectors.column(0).into_owned().into();
    let off = Vector2::new(-b13 / b11, -b23 / b22);
    let scale = b33 - b13 * b13 / b11 - b23 * b23 / b22;
    let focal = Vector2::new(scale / b11, scale / b22).map(f64::sqrt);
    (is_lens(&focal) && off.amax() <= OFF_CENTRE).then_some((focal, off))
}

/// The focal lengths alone, the principal point in the middle: two unknowns bear more noise than four.
fn centred(homographies: &[Matrix3<f64>]) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let (mut square, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for homography in homographies {
        let product = |i: usize, j: usize| homography.column(i).component_mul(&homography.column(j));
        for row in [product(0, 1), product(0, 0) - product(1, 1)] {
            square += row.xy() * row.xy().transpose();
            right -= row.xy() * row.z;
        }
    }
    let focal = (square.try_inverse()? * right).map(|inverse| 1.0 / inverse.sqrt());
    is_lens(&focal).then_some((focal, Vector2::zeros()))
}
