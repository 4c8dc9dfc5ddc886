//! How far a grasp is from the surface that it is meant for.

use geometry::nalgebra::{Point3, Vector3};
use geometry::{Ray, TriangleBvh, TriangleMesh};
use interfaces::rakelight_msgs::msg::Grasp;
use sim::scene::Body;

/// The surface is looked for so far before and behind the contact, along its normal, metres.
const REACH: f64 = 0.02;

/// Of one grasp.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GraspError {
    /// From the contact to the surface, along the grasp's normal, millimetres.
    pub(crate) point_mm: f64,
    /// Between the grasp's normal and the surface's there, degrees.
    pub(crate) normal_deg: f64,
}

/// Against the surface as it is; none when there is none within 20 mm along the normal.
pub(crate) fn error(grasp: &Grasp, bodies: &[Body]) -> Option<GraspError> {
    let contact = Point3::new(grasp.contact.x, grasp.contact.y, grasp.contact.z);
    let normal = Vector3::new(grasp.normal.x, grasp.normal.y, grasp.normal.z).normalize();
    let ray = Ray {
        origin: contact + normal * REACH,
        direction: -normal,
    };
    let hits = bodies.iter().filter_map(|body| {
        let hit = TriangleBvh::new(&body.mesh).ok()?.closest_hit(&ray, 2.0 * REACH)?;
        Some((hit.distance, face_normal(&body.mesh, hit.triangle as usize)))
    });
    let (distance, surface) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(GraspError {
        point_mm: 1e3 * (distance - REACH).abs(),
        normal_deg: surface.angle(&normal).to_degrees(),
    })
}

fn face_normal(mesh: &TriangleMesh, triangle: usize) -> Vector3<f64> {
    let [a, b, c] = mesh.corners(triangle);
    (b - a).cross(&(c - a)).normalize()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use interfaces::geometry_msgs::msg::{Point, Vector3 as VectorMessage};
    use sim::world::World;

    use super::*;

    fn grasp(z: f64, tilt: f64) -> Grasp {
        Grasp {
            contact: Point { x: 0.4, y: 0.1, z },
            normal: VectorMessage {
                x: tilt.sin(),
                y: 0.0,
                z: tilt.cos(),
            },
            ..Grasp::default()
        }
    }

    #[test]
    fn a_grasp_beside_the_surface_and_askew_is_off_by_so_much() {
        let yaml = "objects: [{shape: {kind: box, size: [0.05, 0.05, 0.02]}, pose: {x: 0.4, y: 0.1}}]";
        let bodies = World::from_yaml(yaml, Path::new("")).expect("a world").scene.bodies;
        let exact = error(&grasp(0.02, 0.0), &bodies).expect("a surface");
        assert!(exact.point_mm < 1e-3 && exact.normal_deg < 1e-6, "{exact:?}");
        let off = error(&grasp(0.0215, 0.1), &bodies).expect("a surface");
        assert!((off.point_mm - 1.5 / 0.1_f64.cos()).abs() < 1e-2, "{off:?}");
        assert!((off.normal_deg - 0.1_f64.to_degrees()).abs() < 1e-3, "{off:?}");
        assert!(error(&grasp(0.1, 0.0), &bodies).is_none());
    }
}
