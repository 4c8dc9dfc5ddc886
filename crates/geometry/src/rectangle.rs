//! A one-sided rectangle, and the light it sends to a small patch, in closed form.

use nalgebra::{Point3, Unit, Vector3};

/// A one-sided rectangle: a light panel, a sheet. Base frame, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Middle of it.
    pub centre: Point3<f64>,
    /// Unit vector out of its front.
    pub facing: Unit<Vector3<f64>>,
    /// Unit vector along its first side, at a right angle to `facing`.
    pub right: Unit<Vector3<f64>>,
    /// Length along `right`, and across it.
    pub size: [f64; 2],
}

impl Rectangle {
    /// Irradiance from a front of radiance 1 on a patch that sees it as far as the patch's own horizon allows; `normal`
    /// is the patch's and its length scales the result. 0 behind the rectangle.
    ///
    /// ```
    /// # use geometry::{Rectangle, nalgebra::{Point3, Vector3}};
    /// let panel = Rectangle {
    ///     centre: Point3::new(0.0, 0.0, 1.0),
    ///     facing: -Vector3::z_axis(),
    ///     right: Vector3::x_axis(),
    ///     size: [0.01, 0.01],
    /// };
    /// let below = panel.form_factor(&Point3::origin(), &Vector3::z());
    /// assert!((below - 1e-4).abs() < 1e-8); // area over squared distance
    /// ```
    pub fn form_factor(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        if !self.is_in_front(point) {
            return 0.0;
        }
        form_factor(&self.corners().map(|corner| corner - point), normal)
    }

    /// The vector whose product with a patch's normal is [`Self::form_factor`], for every normal that has the whole
    /// rectangle above its horizon. Zero behind the rectangle.
    pub fn vector_form_factor(&self, point: &Point3<f64>) -> Vector3<f64> {
        if !self.is_in_front(point) {
            return Vector3::zeros();
        }
        let corners = self.corners().map(|corner| corner - point);
        let edges = corners.iter().zip(corners.iter().cycle().skip(1));
        edges.map(|(a, b)| edge_vector(a, b)).sum::<Vector3<f64>>() / 2.0
    }

    fn is_in_front(&self, point: &Point3<f64>) -> bool {
        (point - self.centre).dot(&self.facing) > 0.0
    }

    /// Corners, counter-clockwise as seen from in front of it.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        let right = self.right.into_inner() * (self.size[0] / 2.0);
        let up = self.facing.cross(&self.right) * (self.size[1] / 2.0);
        [-right - up, right - up, right + up, -right + up].map(|offset| self.centre + offset)
    }
}

/// Integral of the cosine over the part of a polygon above the horizon, as seen from the origin. The corners run
/// counter-clockwise as seen from there.
///
/// Lambert's formula, ½ Σ θᵢ n·γᵢ: an edge is seen under the angle θᵢ, γᵢ is the unit normal of the plane through it and
/// the origin (Baum et al., "Improving radiosity solutions through the use of analytically determined form-factors",
/// 1989, eq. 5).
fn form_factor(corners: &[Vector3<f64>; 4], normal: &Vector3<f64>) -> f64 {
    let mut clipped = [Vector3::zeros(); 5];
    let count = clip(corners, normal, &mut clipped);
    let polygon = &clipped[..count];
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let sum: f64 = edges.map(|(a, b)| edge_vector(a, b).dot(normal)).sum();
    (sum / 2.0).max(0.0)
}

fn edge_vector(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let across = b.cross(a);
    let length = across.norm();
    if length < 1e-300 {
        return Vector3::zeros();
    }
    across * (length.atan2(a.dot(b)) / length)
}

/// The part of a convex polygon above the horizon: at most one corner more.
fn clip(corners: &[Vector3<f64>; 4], normal: &Vector3<f64>, out: &mut [Vector3<f64>; 5]) -> usize {
    let heights = corners.map(|corner| corner.dot(normal));
    let mut count = 0;
    let mut push = |corner| {
        if count < out.len() {
            out[count] = corner;
            count += 1;
        }
    };
    for (i, (corner, height)) in corners.iter().zip(heights).enumerate() {
        let next = (i + 1) % 4;
        if height >= 0.0 {
            push(*corner);
        }
        if (height < 0.0) != (heights[next] < 0.0) {
            push(corner.lerp(&corners[next], height / (height - heights[next])));
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Sum of cosine times cosine over squared distance, over small pieces of the panel.
    fn quadrature(panel: &Rectangle, point: &Point3<f64>, normal: &Vector3<f64>, pieces: usize) -> f64 {
        let up = panel.facing.cross(&panel.right);
        let along = |i: usize| (i as f64 + 0.5) / pieces as f64 - 0.5;
        let area = panel.size[0] * panel.size[1] / (pieces * pieces) as f64;
        let piece = |(i, j): (usize, usize)| {
            let right = panel.right.into_inner() * (along(i) * panel.size[0]);
            let to = panel.centre + right + up * (along(j) * panel.size[1]) - point;
            let (here, there) = (normal.dot(&to).max(0.0), (-panel.facing.dot(&to)).max(0.0));
            here * there / to.norm_squared().powi(2) * area
        };
        let all = (0..pieces).flat_map(|i| (0..pieces).map(move |j| (i, j)));
        all.map(piece).sum::<f64>()
    }

    fn panel(centre: [f64; 3], facing: [f64; 3], turn: f64) -> Rectangle {
        let facing = Unit::new_normalize(Vector3::from(facing));
        let side = if facing.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let right = Unit::new_normalize(facing.cross(&side));
        let up = facing.cross(&right);
        Rectangle {
            centre: centre.into(),
            facing,
            right: Unit::new_normalize(right.into_inner() * turn.cos() + up * turn.sin()),
            size: [0.25, 0.1],
        }
    }

    proptest! {
        #[test]
        fn agrees_with_quadrature_above_and_across_the_horizon(
            centre in [-0.5..0.5, -0.5..0.5, -0.3..0.5_f64],
            facing in [-1.0..1.0, -1.0..1.0, -1.0..1.0_f64],
            normal in [-1.0..1.0, -1.0..1.0, -1.0..1.0_f64],
            turn in 0.0..6.0_f64,
        ) {
            prop_assume!(Vector3::from(facing).norm() > 0.1 && Vector3::from(normal).norm() > 0.1);
            prop_assume!(Vector3::from(centre).norm() > 0.2);
            let panel = panel(centre, facing, turn);
            let normal = Vector3::from(normal).normalize();
            let exact = panel.form_factor(&Point3::origin(), &normal);
            let summed = quadrature(&panel, &Point3::origin(), &normal, 120);
            prop_assert!((exact - summed).abs() < 2e-3 * summed + 2e-5, "{exact} but {summed}");
        }
    }

    #[test]
    fn a_panel_that_fills_the_sky_gives_pi_times_its_radiance() {
        let mut panel = panel([0.0, 0.0, 1e-4], [0.0, 0.0, -1.0], 0.0);
        panel.size = [100.0, 100.0];
        let irradiance = panel.form_factor(&Point3::origin(), &Vector3::z());
        assert!((irradiance / std::f64::consts::PI - 1.0).abs() < 1e-4);
    }

    #[test]
    fn half_above_the_horizon_gives_less_than_half_but_not_nothing() {
        let panel = panel([0.5, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.0);
        let level = panel.form_factor(&Point3::origin(), &Vector3::z());
        let facing = panel.form_factor(&Point3::origin(), &Vector3::x());
        assert!(level > 0.01 * facing && level < 0.2 * facing, "{level} of {facing}");
    }

    #[test]
    fn nothing_behind_the_panel_or_below_the_horizon() {
        let panel = panel([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], 0.0);
        assert!(panel.form_factor(&Point3::new(0.0, 0.0, 2.0), &-Vector3::z()) <= 0.0);
        assert!(panel.form_factor(&Point3::origin(), &-Vector3::z()) <= 0.0);
    }
}
