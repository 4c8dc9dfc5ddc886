//! A point from its places in two images, and how well it is known.

use geometry::Ray;
use geometry::nalgebra::{Matrix3, Point2, Point3, Vector3};

use crate::view::View;

const ROUNDS: usize = 4;
/// Along a ray, relative: two points this far apart tell the direction of an epipolar line.
const EPIPOLAR_STEP: f64 = 0.01;

/// A triangulated point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Triangulated {
    /// Base frame.
    pub(crate) point: Point3<f64>,
    /// Symmetric distance of each pixel from the other's epipolar line: the mean of both, pixels.
    pub(crate) epipolar_px: f64,
}

/// Midpoint of the rays' shortest connection, then the point of least squared reprojection error (Hartley and Zisserman,
/// "Multiple view geometry", section 12.3, by Gauss-Newton steps). None where rays are parallel or meet behind a camera.
pub(crate) fn triangulate(views: [&View<'_>; 2], pixels: [Point2<f64>; 2]) -> Option<Triangulated> {
    let rays = [views[0].ray(&pixels[0])?, views[1].ray(&pixels[1])?];
    let [first, second] = nearest(&rays)?;
    let mut point = Point3::from((first.coords + second.coords) / 2.0);
    for _ in 0..ROUNDS {
        point += step(views, &pixels, &point)?;
    }
    let distance = |from: usize, to: usize| {
        let depth = (point - rays[from].origin).dot(&rays[from].direction) / rays[from].direction.norm_squared();
        epipolar_distance(&rays[from], depth, views[to], &pixels[to])
    };
    Some(Triangulated {
        point,
        epipolar_px: f64::midpoint(distance(0, 1)?, distance(1, 0)?),
    })
}

/// Covariance of a point that each view sees with the same error in its image, square metres.
pub(crate) fn covariance(views: &[&View<'_>], point: &Point3<f64>, sigma_px: f64) -> Option<Matrix3<f64>> {
    let mut information = Matrix3::zeros();
    for view in views {
        for row in view.jacobian(point)? {
            information += row * row.transpose();
        }
    }
    Some(information.try_inverse()? * (sigma_px * sigma_px))
}

/// The same of a point that one view sees at a depth of known standard deviation, metres.
pub(crate) fn covariance_at_depth(
    view: &View<'_>,
    point: &Point3<f64>,
    sigma_px: f64,
    sigma_depth: f64,
) -> Option<Matrix3<f64>> {
    let sight = (point - view.centre).normalize();
    let mut information = sight * sight.transpose() / (sigma_depth * sigma_depth);
    for row in view.jacobian(point)? {
        information += row * row.transpose() / (sigma_px * sigma_px);
    }
    information.try_inverse()
}

fn nearest(rays: &[Ray; 2]) -> Option<[Point3<f64>; 2]> {
    let [a, b] = rays;
    let between = b.origin - a.origin;
    let (aa, bb) = (a.direction.norm_squared(), b.direction.norm_squared());
    let ab = a.direction.dot(&b.direction);
    let determinant = aa * bb - ab * ab;
    if determinant < 1e-9 * aa * bb {
        return None;
    }
    let (ca, cb) = (a.direction.dot(&between), b.direction.dot(&between));
    let (s, t) = ((ca * bb - cb * ab) / determinant, (ca * ab - cb * aa) / determinant);
    (s > 0.0 && t > 0.0).then(|| [a.at(s), b.at(t)])
}

fn step(views: [&View<'_>; 2], pixels: &[Point2<f64>; 2], point: &Point3<f64>) -> Option<Vector3<f64>> {
    let (mut left, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (view, pixel) in views.iter().zip(pixels) {
        let residual = pixel - view.project(point)?;
        for (row, residual) in view.jacobian(point)?.iter().zip([residual.x, residual.y]) {
            left += row * row.transpose();
            right += row * residual;
        }
    }
    Some(left.cholesky()?.solve(&right))
}

/// Lenses bend epipolar lines: this one is the tangent where the point is.
fn epipolar_distance(ray: &Ray, depth: f64, other: &View<'_>, pixel: &Point2<f64>) -> Option<f64> {
    let near = other.project(&ray.at(depth * (1.0 - EPIPOLAR_STEP)))?;
    let far = other.project(&ray.at(depth * (1.0 + EPIPOLAR_STEP)))?;
    let along = far - near;
    let offset = pixel - near;
    Some((along.x * offset.y - along.y * offset.x).abs() / along.norm().max(1e-9))
}
