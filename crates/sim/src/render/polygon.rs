//! Light of a panel on a small patch.

use geometry::Rectangle;
use geometry::nalgebra::{Point3, Vector3};

use crate::scene::Panel;

impl Panel {
    /// Where it is.
    pub fn rectangle(&self) -> Rectangle {
        let Self {
            centre,
            facing,
            right,
            size,
            ..
        } = *self;
        Rectangle {
            centre,
            facing,
            right,
            size,
        }
    }

    /// Irradiance on a patch that sees the whole panel as far as the patch's own horizon allows; `normal` is the patch's
    /// and its length scales the result. 0 behind the panel.
    pub fn irradiance(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        self.radiance * self.rectangle().form_factor(point, normal)
    }

    /// Corners, counter-clockwise as seen from in front of it.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        self.rectangle().corners()
    }
}
