//! On which face a body comes to rest.

use geometry::RigidTransform;
use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::try_convex_hull;

use super::fall::Placed;

/// A body this near to its face lies on it, radians.
const FLAT: f64 = 1e-6;
/// A face may miss what is over it by so much of its size: rounding.
const ROUNDING: f64 = 1e-9;

/// A body that tips over turns in steps, radians: coarse ones, then fine ones, so many of each.
const TURNS: [(f64, usize); 2] = [(0.02, 300), (0.004, 300)];

/// On what a body stands, and which way it falls over.
#[derive(Debug)]
pub(super) struct Stance {
    /// Of its convex hull, as seen from its centre of mass; none where it spans no volume.
    corners: Vec<Vector3<f64>>,
    /// Outward normals of the hull's faces over which the centre of mass lies: on those it stands.
    stable_faces: Vec<Vector3<f64>>,
}

impl Stance {
    pub(super) fn new(points: &[Point3<f64>], centre_of_mass: &Point3<f64>) -> Self {
        let points: Vec<Vector> = points
            .iter()
            .map(|point| Vector::new(point.x, point.y, point.z))
            .collect();
        let (corners, faces) = try_convex_hull(&points).unwrap_or_default();
        let corners: Vec<_> = corners
            .iter()
            .map(|corner| Point3::new(corner.x, corner.y, corner.z))
            .collect();
        let stable = |face: &[u32; 3]| stable_normal(face.map(|corner| corners[corner as usize]), centre_of_mass);
        Self {
            stable_faces: faces.iter().filter_map(stable).collect(),
            corners: corners.iter().map(|corner| corner - centre_of_mass).collect(),
        }
    }

    /// The face that a body comes to stand on which is let go with this direction (unit, in its frame) downwards: it tips
    /// over its lowest corner, always so that its centre of mass sinks, until it can sink no more.
    fn face_below(&self, mut down: Vector3<f64>) -> Option<&Vector3<f64>> {
        for step in TURNS
            .iter()
            .flat_map(|(step, count)| std::iter::repeat_n(*step, *count))
        {
            let lowest = self
                .corners
                .iter()
                .max_by(|a, b| a.dot(&down).total_cmp(&b.dot(&down)))?;
            let aside = lowest - down * lowest.dot(&down);
            let Some(away) = aside.try_normalize(f64::EPSILON) else {
                break;
            };
            down = (down - away * step).normalize();
        }
        let faces = self.stable_faces.iter();
        faces.max_by(|a, b| a.dot(&down).total_cmp(&b.dot(&down)))
    }
}

/// The normal of a face, if the point of its plane that is nearest to the centre of mass is on it. Of a face of several
/// triangles this is one of them.
fn stable_normal(corners: [Point3<f64>; 3], centre_of_mass: &Point3<f64>) -> Option<Vector3<f64>> {
    let [a, b, c] = corners;
    let across = (b - a).cross(&(c - a));
    let normal = across.try_normalize(0.0)?;
    let foot = centre_of_mass - normal * normal.dot(&(centre_of_mass - a));
    let is_inside = |from: Point3<f64>, to: Point3<f64>| {
        (to - from).cross(&(foot - from)).dot(&normal) >= -ROUNDING * across.norm()
    };
    (is_inside(a, b) && is_inside(b, c) && is_inside(c, a)).then_some(normal)
}

/// A body turned about its centre of mass until it stands on the face on which it comes to rest.
pub(crate) fn at_rest(body: &Placed<'_>) -> RigidTransform {
    let down = body.base_from_solid.inverse().transform_direction(&-Vector3::z());
    let tilt = body.solid.stance().face_below(down).and_then(|face| {
        let face_in_base = body.base_from_solid.transform_direction(face);
        // None for a body on its head; a turn about any level axis does.
        let turn = UnitQuaternion::rotation_between(&face_in_base, &-Vector3::z());
        Some(turn.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)))
            .filter(|turn| turn.angle() > FLAT)
    });
    let Some(turn) = tilt else {
        return body.base_from_solid;
    };
    let centre = body.centre_of_mass().coords;
    let about_centre = RigidTransform::from_parts(centre - turn * centre, turn);
    about_centre * body.base_from_solid
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::solid::Solid;
    use super::*;
    use crate::objects::{Cuboid, Cylinder, Pyramid, Shape};

    fn solid(shape: &Shape) -> Solid {
        Solid::new(shape.mesh(Path::new("")).expect("a shape")).expect("a mesh")
    }

    /// Where the body's z axis points after it came to rest from this roll.
    fn axis_at_rest(solid: &Solid, roll: f64) -> Vector3<f64> {
        let base_from_solid = RigidTransform::from_parts(
            Vector3::new(0.4, 0.1, 0.2),
            UnitQuaternion::from_euler_angles(roll, 0.0, 0.7),
        );
        let rested = at_rest(&Placed { solid, base_from_solid });
        let centre = base_from_solid.transform_point(&solid.centre_of_mass());
        let centre_at_rest = rested.transform_point(&solid.centre_of_mass());
        assert!((centre - centre_at_rest).norm() < 1e-12, "the centre of mass stays");
        rested.transform_direction(&Vector3::z())
    }

    #[test]
    fn a_block_comes_to_rest_on_the_face_that_it_tips_over_to() {
        let block = solid(&Shape::Box(Cuboid {
            size: Some([0.05, 0.04, 0.03]),
        }));
        assert!((axis_at_rest(&block, 0.2) - Vector3::z()).norm() < 1e-9);
        assert!(axis_at_rest(&block, 1.3).z.abs() < 1e-9, "on its side");
        assert!((axis_at_rest(&block, 3.0) + Vector3::z()).norm() < 1e-9, "on its head");
        // Over its edge at 53 degrees.
        assert!(axis_at_rest(&block, 0.88).z > 0.999 && axis_at_rest(&block, 0.97).z.abs() < 1e-9);
        assert!((axis_at_rest(&block, std::f64::consts::PI) + Vector3::z()).norm() < 1e-9);
    }

    #[test]
    fn nothing_stands_on_a_face_that_it_tips_over() {
        // A tall pyramid stands on its base or lies on a side, but a leaning tower's end is no place to stand.
        let pyramid = solid(&Shape::Pyramid(Pyramid {
            side: 0.05,
            height: 0.03,
        }));
        assert!((axis_at_rest(&pyramid, 0.4) - Vector3::z()).norm() < 1e-9);
        let points = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.05, 0.05, 0.03]].map(Point3::from);
        let centre = Point3::new(0.015, 0.015, 0.007_5);
        let normals = Stance::new(&points, &centre).stable_faces;
        assert!(normals.iter().all(|normal| normal.z > -0.999), "{normals:?}");
    }

    #[test]
    fn a_disc_on_its_edge_falls_over_and_a_rod_lies_as_it_lay() {
        let disc = solid(&Shape::Disc(Cylinder::default()));
        assert!((axis_at_rest(&disc, 1.0) - Vector3::z()).norm() < 1e-9);
        assert!((axis_at_rest(&disc, 1.4) - Vector3::z()).norm() < 1e-9);
        let rod = solid(&Shape::Cylinder(Cylinder::default()));
        assert!(axis_at_rest(&rod, 1.5).z.abs() < 1e-9);
    }
}
