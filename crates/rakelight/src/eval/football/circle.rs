//! The circle that most of a mask's outline lies on.

use anyhow::Context;
use geometry::nalgebra::{Matrix3, Vector3};
use imaging::Mask;

/// Rounds in which points off the circle lose their weight.
const ROUNDS: usize = 20;
/// Distance at which a point counts half, as a share of the radius: a ball of panels is round to about this.
const ROUND: f64 = 0.01;

/// Pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Circle {
    pub(super) middle: [f64; 2],
    pub(super) radius: f64,
}

impl Circle {
    /// From the widest row down to the smallest misfit (iteratively reweighted least squares of Kåsa's linear form): a
    /// stand below the ball does not count.
    pub(super) fn of_outline(mask: &Mask) -> anyhow::Result<Self> {
        let spans = spans(mask);
        let (y, [left, right]) = *spans
            .iter()
            .max_by_key(|(_, [left, right])| right - left)
            .context("the mask is empty")?;
        let mut circle = Self {
            middle: [(left + right) as f64 / 2.0, y as f64],
            radius: (right - left) as f64 / 2.0,
        };
        let points: Vec<[f64; 2]> = spans
            .iter()
            .flat_map(|&(y, ends)| ends.map(|x| [x as f64, y as f64]))
            .collect();
        for _ in 0..ROUNDS {
            circle = circle.step(&points).context("the mask's outline is no circle")?;
        }
        Ok(circle)
    }

    /// Anew from the points near the present one.
    fn step(&self, points: &[[f64; 2]]) -> Option<Self> {
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for point in points {
            // About the present middle and in units of the radius, so that the numbers are small.
            let [x, y] = [0, 1].map(|axis| (point[axis] - self.middle[axis]) / self.radius);
            let weight = 1.0 / (1.0 + ((x.hypot(y) - 1.0) / ROUND).powi(2)).powi(2);
            let row = Vector3::new(x, y, 1.0);
            matrix += row * row.transpose() * weight;
            right += row * (weight * (x * x + y * y));
        }
        let [x, y, rest] = (matrix.try_inverse()? * right).into();
        let square = rest + (x * x + y * y) / 4.0;
        (square > 0.0).then(|| Self {
            middle: [
                self.middle[0] + x / 2.0 * self.radius,
                self.middle[1] + y / 2.0 * self.radius,
            ],
            radius: square.sqrt() * self.radius,
        })
    }
}

/// Rows that have pixels, with their first and last.
fn spans(mask: &Mask) -> Vec<(usize, [usize; 2])> {
    let ends = |(y, row): (usize, &[u8])| {
        let first = row.iter().position(|&value| value != 0)?;
        Some((y, [first, row.iter().rposition(|&value| value != 0)?]))
    };
    mask.as_image().rows().enumerate().filter_map(ends).collect()
}

#[cfg(test)]
mod tests {
    use imaging::Image;

    use super::*;

    #[test]
    fn a_ball_on_a_stand_is_found_without_the_stand() {
        let shape = |x: usize, y: usize| {
            let is_ball = (x as f64 - 150.3).hypot(y as f64 - 130.8) <= 110.0;
            let is_stand = (100..190).contains(&x) && y > 200;
            u8::from(is_ball || is_stand)
        };
        let mask = Mask::from_nonzero(&Image::from_fn(300, 320, shape));
        let found = Circle::of_outline(&mask).expect("a circle");
        let off = (found.middle[0] - 150.3).hypot(found.middle[1] - 130.8);
        assert!(off < 0.7 && (found.radius - 110.0).abs() < 0.7, "{found:?}");
    }

    #[test]
    fn an_empty_mask_is_refused() {
        let mask = Mask::from_nonzero(&Image::filled(4, 4, 0));
        assert!(Circle::of_outline(&mask).is_err());
    }
}
