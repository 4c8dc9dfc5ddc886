//! Where a corner of the squares is, to hundredths of a pixel: by gradients first, then by a model of its picture.
//!
//! Every brightness gradient near the corner is at right angles to the line from the corner to it: on an edge because the
//! edge runs through the corner, elsewhere because the gradient is zero. The corner `q` that fits best,
//! `argmin Σ w (∇I(p) · (p - q))²`, solves `(Σ w ∇I ∇Iᵀ) q = Σ w ∇I ∇Iᵀ p` (Förstner and Gülch 1987, "A fast operator for
//! detection and precise location of distinct points, corners and centres of circular features", equation 4).

use imaging::Image;
use nalgebra::{Matrix2, Point2, Vector2};

use crate::saddle::fit_saddle;

/// Rounds, each with its window around what the one before found; three are usual.
const ROUNDS: usize = 12;
/// The corner is found when it moves by less, pixels.
const STILL: f64 = 1e-4;
/// Furthest that a corner may be from where it was seen first, pixels.
const FURTHEST: f64 = 2.0;
/// Least ratio of the two eigenvalues: along one edge alone nothing is known.
const LEAST_RATIO: f64 = 0.05;

/// The corner near `seed` from a window of half side `half` (pixels); none at the image's border, or where there is no
/// corner.
pub(crate) fn refine_corner(image: &Image<u16>, seed: &Point2<f64>, half: f64) -> Option<Point2<f64>> {
    let mut corner = *seed;
    for _ in 0..ROUNDS {
        let next = round(image, &corner, half)?;
        let moved = (next - corner).norm();
        corner = next;
        if (corner - seed).norm() > FURTHEST {
            return None;
        }
        if moved < STILL {
            break;
        }
    }
    fit_saddle(image, &corner, half).filter(|fitted| (fitted - seed).norm() <= FURTHEST)
}

/// Gradients at the pixels themselves, weighted with a round window that moves with the corner.
fn round(image: &Image<u16>, corner: &Point2<f64>, half: f64) -> Option<Point2<f64>> {
    let reach = half.ceil() as i64;
    let (centre_x, centre_y) = (corner.x.round() as i64, corner.y.round() as i64);
    let inside = |centre: i64, length: usize| centre > reach && centre + reach + 1 < length as i64;
    if !inside(centre_x, image.width()) || !inside(centre_y, image.height()) {
        return None;
    }
    let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for y in centre_y - reach..=centre_y + reach {
        for x in centre_x - reach..=centre_x + reach {
            let from_corner = Vector2::new(x as f64, y as f64) - corner.coords;
            let share = from_corner.norm_squared() / (half * half);
            if share >= 1.0 {
                continue;
            }
            let gradient = gradient(image, x as usize, y as usize);
            let outer = gradient * gradient.transpose() * (1.0 - share).powi(2);
            matrix += outer;
            right += outer * from_corner;
        }
    }
    let values = matrix.symmetric_eigenvalues();
    if values.min() <= LEAST_RATIO * values.max() {
        return None;
    }
    Some(corner + matrix.try_inverse()? * right)
}

/// Scharr's operator: the same in all directions, and quiet.
fn gradient(image: &Image<u16>, x: usize, y: usize) -> Vector2<f64> {
    let rows = [image.row(y - 1), image.row(y), image.row(y + 1)];
    let at = |row: usize, column: usize| f64::from(rows[row][column]);
    let across = |row: usize| at(row, x + 1) - at(row, x - 1);
    let down = |column: usize| at(2, column) - at(0, column);
    Vector2::new(
        3.0 * across(0) + 10.0 * across(1) + 3.0 * across(2),
        3.0 * down(x - 1) + 10.0 * down(x) + 3.0 * down(x + 1),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two edges through the corner, each blurred over `softness` pixels.
    fn corner_image(corner: [f64; 2], angles: [f64; 2], softness: f64) -> Image<u16> {
        let side = |x: usize, y: usize, angle: f64| {
            let (dx, dy) = (x as f64 - corner[0], y as f64 - corner[1]);
            ((dy * angle.cos() - dx * angle.sin()) / softness).tanh()
        };
        Image::from_fn(40, 40, |x, y| {
            let product = side(x, y, angles[0]) * side(x, y, angles[1]);
            (30_000.0 + 20_000.0 * product).round() as u16
        })
    }

    #[test]
    fn corners_are_found_to_a_hundredth_of_a_pixel_whatever_their_angles() {
        let mut random = fastrand::Rng::with_seed(8);
        for _ in 0..200 {
            let truth = [19.5 + random.f64(), 19.5 + random.f64()];
            let first = random.f64() * 3.0;
            let image = corner_image(truth, [first, first + 1.1 + 0.9 * random.f64()], 1.0 + random.f64());
            let seed = Point2::new(truth[0] + random.f64() - 0.5, truth[1] + random.f64() - 0.5);
            let found = refine_corner(&image, &seed, 6.0).unwrap();
            let off = (found - Point2::from(truth)).norm();
            assert!(off < 0.01, "{off} px at {truth:?}, {first}");
        }
    }

    #[test]
    fn in_noise_the_error_is_what_the_edges_allow() {
        let mut random = fastrand::Rng::with_seed(9);
        let mut squares = 0.0;
        for _ in 0..300 {
            let truth = [19.5 + random.f64(), 19.5 + random.f64()];
            let first = random.f64() * 3.0;
            let mut image = corner_image(truth, [first, first + 1.2 + 0.7 * random.f64()], 1.2);
            for pixel in image.pixels_mut() {
                // Twelve uniform numbers make a normal one: 1 % of full scale.
                let normal: f64 = (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
                *pixel = (f64::from(*pixel) + 655.0 * normal) as u16;
            }
            let found = refine_corner(&image, &Point2::new(20.0, 20.0), 8.0).unwrap();
            squares += (found - Point2::from(truth)).norm_squared() / 300.0;
        }
        assert!(squares.sqrt() < 0.02, "{} px", squares.sqrt());
    }

    #[test]
    fn where_there_is_no_corner_none_is_found() {
        let corner = corner_image([20.0, 20.0], [0.3, 1.7], 1.0);
        assert_eq!(
            refine_corner(&corner, &Point2::new(4.0, 20.0), 6.0),
            None,
            "at the border"
        );
        assert_eq!(
            refine_corner(&corner, &Point2::new(29.0, 23.0), 5.0),
            None,
            "on an edge"
        );
        assert_eq!(
            refine_corner(&Image::filled(40, 40, 9), &Point2::new(20.0, 20.0), 5.0),
            None,
            "on nothing"
        );
    }
}
