//! A panel as a list of numbers to fit.

use geometry::Rectangle;
use geometry::nalgebra::{SVector, Unit, Vector3};

use crate::light_rig::{Bounce, PanelModel};

/// Centre (3), aim (2), log radiance (1), bounce (4).
pub(super) const COUNT: usize = 10;

/// Steps from a panel: metres, radians, logarithm, irradiance.
pub(super) type Step = SVector<f64, COUNT>;

/// Natural size of each step; the numeric derivative uses a thousandth, the damping is relative to it.
pub(super) const SCALES: [f64; COUNT] = [0.02, 0.02, 0.02, 0.1, 0.1, 0.05, 0.001, 0.001, 0.001, 0.001];

/// The panel after a step. Its long side stays level.
pub(super) fn moved(panel: &PanelModel, step: &Step) -> PanelModel {
    let rectangle = &panel.rectangle;
    let up = rectangle.facing.cross(&rectangle.right);
    let facing = rectangle.facing.into_inner() + rectangle.right.into_inner() * step[3] + up * step[4];
    let facing = Unit::new_normalize(facing);
    let old_right = rectangle.right.into_inner();
    let right = Unit::new_normalize(old_right - facing.into_inner() * facing.dot(&old_right));
    PanelModel {
        channel: panel.channel,
        rectangle: Rectangle {
            centre: rectangle.centre + Vector3::new(step[0], step[1], step[2]),
            facing,
            right,
            size: rectangle.size,
        },
        radiance: panel.radiance * step[5].exp(),
        bounce: Bounce {
            constant: panel.bounce.constant + step[6],
            linear: panel.bounce.linear + Vector3::new(step[7], step[8], step[9]),
        },
    }
}
