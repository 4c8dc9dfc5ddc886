//! Where the bodies of a world are.

use geometry::RigidTransform;

use crate::scene::Scene;
use crate::world::World;

/// An arm that is held trembles by less, metres and radians; no pixel shows it.
const UNSEEN: [f64; 2] = [2e-6, 5e-6];

/// Bodies of the world that can be seen, by their position in it, with where they are.
pub(in crate::cell) type Places = Vec<(usize, RigidTransform)>;

/// Two equal layouts look alike.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// Which scene it is of: rises with every other.
    pub(super) scene: u64,
    pub(super) places: Places,
}

impl Layout {
    /// Whether cameras see no difference.
    pub(super) fn is_as_seen(&self, other: &Self) -> bool {
        let alike = |((a, here), (b, there)): (&(usize, RigidTransform), &(usize, RigidTransform))| {
            a == b && is_as_seen(here, there)
        };
        let is_as_long = self.places.len() == other.places.len();
        self.scene == other.scene && is_as_long && self.places.iter().zip(&other.places).all(alike)
    }

    /// The world's scene with its bodies there, and no others.
    pub(super) fn scene(&self, world: &World) -> Scene {
        let body = |(index, base_from_body): &(usize, RigidTransform)| {
            let mut body = world.scene.bodies[*index].clone();
            if body.base_from_body != *base_from_body {
                let there_from_here = *base_from_body * body.base_from_body.inverse();
                body.mesh = body.mesh.transformed(&there_from_here);
                body.base_from_body = *base_from_body;
            }
            body
        };
        Scene {
            bodies: self.places.iter().map(body).collect(),
            room: world.scene.room.clone(),
            ..world.scene
        }
    }
}

pub(super) fn is_as_seen(shown: &RigidTransform, now: &RigidTransform) -> bool {
    let off = shown.inverse() * *now;
    off.translation().norm() < UNSEEN[0] && off.rotation().angle() < UNSEEN[1]
}
