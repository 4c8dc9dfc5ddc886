//! What the arm's cup can take hold of: the objects of the scene. The table's mat is porous.

use std::f64::consts::TAU;

use geometry::nalgebra::{Point3, Vector3};
use geometry::{Ray, RigidTransform, TriangleBvh, TriangleMesh};
use parking_lot::Mutex;

use crate::SimError;
use crate::arm::SuctionWorld;
use crate::scene::Scene;

/// Of the cup's rim, metres.
const RADIUS: f64 = 0.010;
/// How far the rim gives way, metres.
const COMPLIANCE: f64 = 0.003;
/// Looked at from so far inside the cup, metres.
const INSIDE: f64 = 0.010;
/// Places on the rim that are looked at.
const PLACES: u32 = 12;
/// Of printed plastic, kg/m³.
const DENSITY: f64 = 1200.0;

#[derive(Debug)]
pub(super) struct SceneSuction {
    surfaces: Mutex<Vec<Surface>>,
}

#[derive(Debug)]
struct Surface {
    bvh: TriangleBvh,
    /// Kilograms.
    mass: f64,
}

impl SceneSuction {
    pub(super) fn new(scene: &Scene) -> Result<Self, SimError> {
        Ok(Self {
            surfaces: Mutex::new(surfaces(scene)?),
        })
    }

    pub(super) fn set_scene(&self, scene: &Scene) -> Result<(), SimError> {
        *self.surfaces.lock() = surfaces(scene)?;
        Ok(())
    }
}

fn surfaces(scene: &Scene) -> Result<Vec<Surface>, SimError> {
    let surface = |mesh: &TriangleMesh| {
        Ok(Surface {
            bvh: TriangleBvh::new(mesh)?,
            mass: DENSITY * volume(mesh),
        })
    };
    scene.bodies.iter().map(|body| surface(&body.mesh)).collect()
}

/// Of a closed mesh, m³: the sum of the tetrahedra from the origin to its triangles.
fn volume(mesh: &TriangleMesh) -> f64 {
    let tetrahedron = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle).map(|corner| corner.coords);
        a.dot(&b.cross(&c)) / 6.0
    };
    (0..mesh.triangles.len()).map(tetrahedron).sum::<f64>().abs()
}

impl SuctionWorld for SceneSuction {
    fn touched(&self, base_from_cup: &RigidTransform) -> Option<f64> {
        let surfaces = self.surfaces.lock();
        let found = surfaces.iter().find(|surface| is_sealed(&surface.bvh, base_from_cup));
        found.map(|surface| surface.mass)
    }
}

/// Whether the surface is before the rim all around, as near as it gives way.
fn is_sealed(bvh: &TriangleBvh, base_from_cup: &RigidTransform) -> bool {
    let direction = base_from_cup.transform_direction(&Vector3::z());
    (0..PLACES).all(|place| {
        let angle = TAU * f64::from(place) / f64::from(PLACES);
        let start = Point3::new(RADIUS * angle.cos(), RADIUS * angle.sin(), -INSIDE);
        let ray = Ray {
            origin: base_from_cup.transform_point(&start),
            direction,
        };
        let hit = bvh.closest_hit(&ray, INSIDE + COMPLIANCE);
        hit.is_some_and(|hit| hit.distance >= INSIDE - COMPLIANCE)
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use geometry::nalgebra::UnitQuaternion;

    use super::*;
    use crate::world::World;

    /// A pose above the octagon's top, looking down, so far from it.
    fn touched(shift: [f64; 3], tilt: f64) -> Option<f64> {
        let yaml = "objects: [{shape: {kind: octagon2, width: 0.09, height: 0.029}, pose: {x: 0.4, y: 0.1}}]";
        let world = World::from_yaml(yaml, Path::new("")).expect("a world");
        let body = &world.scene.bodies[0].mesh;
        let top = body.vertices.iter().map(|vertex| vertex.z).fold(0.0, f64::max);
        let place = Vector3::new(0.4 + shift[0], 0.1 + shift[1], top + shift[2]);
        let down = UnitQuaternion::from_euler_angles(std::f64::consts::PI + tilt, 0.0, 0.0);
        let suction = SceneSuction::new(&world.scene).expect("meshes");
        suction.touched(&RigidTransform::from_parts(place, down))
    }

    #[test]
    fn a_rim_that_lies_on_an_object_seals() {
        for height in [-0.002, 0.0, 0.002] {
            let mass = touched([0.0, 0.0, height], 0.0).expect("a seal");
            // Some 9 cm by 3 cm of plastic.
            assert!((0.05..0.3).contains(&mass), "{mass} kg");
        }
        assert!(
            touched([0.0, 0.0, 0.0], 0.1).is_some(),
            "1 mm at the rim is given way to"
        );
    }

    #[test]
    fn a_rim_in_the_air_or_over_an_edge_does_not() {
        assert_eq!(touched([0.0, 0.0, 0.004], 0.0), None);
        assert_eq!(touched([0.0, 0.0, -0.004], 0.0), None);
        assert_eq!(touched([0.05, 0.0, 0.0], 0.0), None);
        assert_eq!(touched([0.0, 0.0, 0.0], 0.4), None, "tilted");
    }
}
