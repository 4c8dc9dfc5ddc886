//! How far a body falls straight down.

use geometry::nalgebra::{Point3, Vector3};
use geometry::{Ray, RigidTransform};

use super::solid::Solid;

/// Bodies in each other by less are taken to lie on each other, metres.
const OVERLAP: f64 = 0.002;
/// Nothing is higher, metres.
const HIGHEST: f64 = 10.0;

/// A body and where it is.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'a> {
    pub(crate) solid: &'a Solid,
    pub(crate) base_from_solid: RigidTransform,
}

/// Sides of a box along the base's axes.
#[derive(Clone, Copy)]
struct Bounds {
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Placed<'_> {
    /// Base frame.
    pub(crate) fn centre_of_mass(&self) -> Point3<f64> {
        self.base_from_solid.transform_point(&self.solid.centre_of_mass())
    }

    /// Height of its lowest point, metres.
    pub(crate) fn lowest(&self) -> f64 {
        self.bounds().low.z
    }

    fn bounds(&self) -> Bounds {
        let nothing = Bounds {
            low: Point3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
            high: Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
        };
        let vertices = self.solid.mesh().vertices.iter();
        vertices.fold(nothing, |bounds, vertex| {
            let vertex = self.base_from_solid.transform_point(vertex);
            Bounds {
                low: bounds.low.inf(&vertex),
                high: bounds.high.sup(&vertex),
            }
        })
    }

    /// The least way from its probes within `bounds`, seen from above, to the other body, straight down or up.
    fn way_to(&self, other: &Placed<'_>, bounds: &Bounds, down: f64) -> f64 {
        let direction = Vector3::new(0.0, 0.0, down);
        let way = |probe: &Point3<f64>| {
            let probe = self.base_from_solid.transform_point(probe);
            // It may begin a little inside.
            let origin = probe - direction * OVERLAP;
            let ray = Ray { origin, direction };
            bounds.is_above_or_below(&probe).then_some(())?;
            let way = other.solid.hit(&other.base_from_solid, &ray, HIGHEST)?;
            Some(way - OVERLAP)
        };
        self.solid.probes().iter().filter_map(way).fold(f64::INFINITY, f64::min)
    }
}

impl Bounds {
    fn is_above_or_below(&self, point: &Point3<f64>) -> bool {
        let within = |axis: usize| (self.low[axis]..=self.high[axis]).contains(&point[axis]);
        within(0) && within(1)
    }

    fn is_apart(&self, other: &Self) -> bool {
        (0..2).any(|axis| self.low[axis] > other.high[axis] || other.low[axis] > self.high[axis])
    }
}

/// Metres from a body straight down to another; infinite where it passes by. Exact where a corner meets a face; where
/// two edges cross, right to 0.13 mm for slopes of up to 45 degrees.
pub(crate) fn gap_below(upper: &Placed<'_>, lower: &Placed<'_>) -> f64 {
    let (above, below) = (upper.bounds(), lower.bounds());
    if above.is_apart(&below) || below.low.z > above.high.z {
        return f64::INFINITY;
    }
    upper.way_to(lower, &below, -1.0).min(lower.way_to(upper, &above, 1.0))
}

/// Metres that a body falls until it lies on the floor (a height, metres) or on something that stands on it.
pub(crate) fn way_down(falling: &Placed<'_>, standing: &[Placed<'_>], floor: f64) -> f64 {
    let to_floor = falling.lowest() - floor;
    let gaps = standing.iter().map(|other| gap_below(falling, other));
    gaps.fold(to_floor, f64::min).max(0.0)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use geometry::nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    use super::*;
    use crate::objects::{Ball, Cuboid, Pyramid, Shape};

    fn solid(shape: &Shape) -> Solid {
        Solid::new(shape.mesh(Path::new("")).expect("a shape")).expect("a mesh")
    }

    fn block(size: [f64; 3]) -> Solid {
        solid(&Shape::Box(Cuboid { size: Some(size) }))
    }

    fn at(solid: &Solid, place: [f64; 3], yaw: f64) -> Placed<'_> {
        let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw);
        Placed {
            solid,
            base_from_solid: RigidTransform::from_parts(place.into(), rotation),
        }
    }

    #[test]
    fn a_block_falls_on_the_table_or_on_what_is_below_it() {
        let (falling, standing) = (block([0.04, 0.03, 0.02]), block([0.05, 0.05, 0.013]));
        let falling = at(&falling, [0.4, 0.0, 0.1], 0.3);
        let way = |place| way_down(&falling, &[at(&standing, place, 0.0)], 0.0);
        assert!((way([0.4, 0.0, 0.0]) - 0.087).abs() < 1e-6, "on top");
        assert!((way([0.43, 0.03, 0.0]) - 0.087).abs() < 1e-6, "with a corner on it");
        assert!((way([0.5, 0.0, 0.0]) - 0.1).abs() < 1e-6, "beside");
        assert!(
            (way([0.4, 0.0, 0.2]) - 0.1).abs() < 1e-6,
            "what is above does not matter"
        );
    }

    #[test]
    fn bars_that_cross_meet_though_no_corner_of_one_is_over_the_other() {
        let bar = block([0.1, 0.01, 0.01]);
        let way = way_down(&at(&bar, [0.4, 0.0, 0.05], 0.0), &[at(&bar, [0.4, 0.0, 0.0], 1.2)], 0.0);
        assert!((way - 0.04).abs() < 1e-6, "{way}");
    }

    #[test]
    fn edges_that_cross_meet_within_a_fifth_of_a_millimetre() {
        // Two square bars on their edges.
        let bar = block([0.1, 0.01, 0.01]);
        let on_edge = |height: f64, yaw: f64| {
            let rotation = UnitQuaternion::from_euler_angles(std::f64::consts::FRAC_PI_4, 0.0, yaw);
            Placed {
                solid: &bar,
                base_from_solid: RigidTransform::from_parts(Vector3::new(0.4, 0.0, height), rotation),
            }
        };
        let (upper, lower) = (on_edge(0.1, 0.0), on_edge(0.03, 1.1));
        let way = gap_below(&upper, &lower);
        assert!((way - (0.07 - 0.01 * 2_f64.sqrt())).abs() < 2e-4, "{way}");
    }

    #[test]
    fn what_lies_on_something_does_not_fall() {
        let (plate, disc) = (block([0.09, 0.09, 0.003]), block([0.05, 0.05, 0.003_15]));
        let gap = gap_below(&at(&disc, [0.41, 0.01, 0.003], 0.4), &at(&plate, [0.4, 0.0, 0.0], 0.0));
        assert!(gap.abs() < 1e-6, "{gap}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// A ball on a pyramid's slope or tip: its lowest way to a plane at a slope is known.
        #[test]
        fn a_ball_comes_down_on_a_pyramid_as_geometry_says(x in -0.03_f64..0.03, y in -0.03_f64..0.03) {
            let pyramid = solid(&Shape::Pyramid(Pyramid { side: 0.1, height: 0.05 }));
            let radius = 0.02;
            let ball = solid(&Shape::Sphere(Ball { radius: Some(radius), segments: Some(120) }));
            let way = gap_below(&at(&ball, [x, y, 0.2], 0.0), &at(&pyramid, [0.0; 3], 0.0));
            // Centre over the slopes |z| = 0.05 - max(|x|, |y|): offset by the radius, or around the tip and the ridges.
            let height = |dx: f64, dy: f64| {
                let square = radius * radius - dx * dx - dy * dy;
                let slope = 0.05 - (x + dx).abs().max((y + dy).abs());
                (square >= 0.0).then(|| slope + square.sqrt() - radius)
            };
            let steps = || (-100..=100).map(|step| f64::from(step) * radius / 100.0);
            let highest = steps().flat_map(|dx| steps().filter_map(move |dy| height(dx, dy)));
            let expected = 0.2 - highest.fold(0.0, f64::max);
            prop_assert!((way - expected).abs() < 2e-4, "{way} is not {expected}");
        }
    }
}
