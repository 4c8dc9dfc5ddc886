//! Maps of the target's plane to the image, and what they say at once.

use geometry::RigidTransform;
use nalgebra::{Matrix3, Point2, Point3, Rotation3, SMatrix, UnitQuaternion, Vector3};

/// A point of the target's plane and where it is seen.
pub(crate) type Match = (Point3<f64>, Point2<f64>);

/// Shifts and scales points so that numbers of very different sizes do not meet (Hartley 1997).
fn normaliser(points: impl Iterator<Item = Point2<f64>> + Clone) -> Option<Matrix3<f64>> {
    let count = points.clone().count() as f64;
    let centre = points.clone().map(|point| point.coords).sum::<nalgebra::Vector2<f64>>() / count;
    let mean = points.map(|point| (point.coords - centre).norm()).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / mean;
    let matrix = Matrix3::new(
        scale,
        0.0,
        -scale * centre.x,
        0.0,
        scale,
        -scale * centre.y,
        0.0,
        0.0,
        1.0,
    );
    scale.is_finite().then_some(matrix)
}

fn apply(matrix: &Matrix3<f64>, point: Point2<f64>) -> Point2<f64> {
    let image = matrix * point.coords.push(1.0);
    Point2::new(image.x / image.z, image.y / image.z)
}

/// `image ~ H target` by the direct linear transform; none when the points are on a line.
pub(crate) fn homography(matches: &[Match]) -> Option<Matrix3<f64>> {
    let from = normaliser(matches.iter().map(|(point, _)| point.xy()))?;
    let to = normaliser(matches.iter().map(|(_, pixel)| *pixel))?;
    let mut square = SMatrix::<f64, 9, 9>::zeros();
    for (point, pixel) in matches {
        let (p, q) = (apply(&from, point.xy()), apply(&to, *pixel));
        let rows = [
            [p.x, p.y, 1.0, 0.0, 0.0, 0.0, -q.x * p.x, -q.x * p.y, -q.x],
            [0.0, 0.0, 0.0, p.x, p.y, 1.0, -q.y * p.x, -q.y * p.y, -q.y],
        ];
        for row in rows {
            let row = SMatrix::<f64, 1, 9>::from(row);
            square += row.transpose() * row;
        }
    }
    let (values, vectors) = sorted_eigen(&square);
    // Two vanishing values: more than one map fits.
    if values[1] <= 1e-9 * values[8] {
        return None;
    }
    let found = Matrix3::from_row_slice(vectors.column(0).as_slice());
    Some(to.try_inverse()? * found * from)
}

/// Eigenvalues from the smallest up, with their vectors.
pub(crate) fn sorted_eigen<const N: usize>(matrix: &SMatrix<f64, N, N>) -> ([f64; N], SMatrix<f64, N, N>) {
    let dynamic = nalgebra::DMatrix::from_column_slice(N, N, matrix.as_slice());
    let eigen = dynamic.symmetric_eigen();
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let vectors = SMatrix::from_fn(|row, column| eigen.eigenvectors[(row, order[column])]);
    (order.map(|index| eigen.eigenvalues[index]), vectors)
}

/// `camera_from_target` of a homography to the plane z = 1 (Zhang 2000, section 3.1), with the target before the camera.
pub(crate) fn pose(ideal_from_target: &Matrix3<f64>) -> Option<RigidTransform> {
    let [first, second, third] = [0, 1, 2].map(|column| ideal_from_target.column(column).into_owned());
    let length = (first.norm() * second.norm()).sqrt();
    let scale = third.z.signum() / length;
    if !scale.is_finite() || third.z == 0.0 {
        return None;
    }
    let (x, y) = (first * scale, second * scale);
    let rough = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    let rotation = nearest_rotation(&rough)?;
    let translation: Vector3<f64> = third * scale;
    Some(RigidTransform::from_parts(translation, rotation))
}

/// The rotation closest to a matrix, by its singular values.
pub(crate) fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let svd = matrix.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut signs = Matrix3::identity();
    signs[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = Rotation3::from_matrix_unchecked(u * signs * v_t);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}
