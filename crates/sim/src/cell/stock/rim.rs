//! The rim of the cup, felt at places all around.

use std::f64::consts::TAU;

use geometry::nalgebra::{Point3, Vector3};
use geometry::{Ray, RigidTransform};

use crate::physics::Placed;

/// Of the cup's rim, metres.
const RADIUS: f64 = 0.010;
/// How far the rim gives way, metres.
const COMPLIANCE: f64 = 0.003;
/// Length of the cup's lip, metres; looked at from so far inside.
const LIP: f64 = 0.012;
/// Places on the rim that are looked at.
const PLACES: u32 = 12;

pub(super) struct Rim {
    /// From inside the cup out of its mouth, with a direction of length 1.
    rays: [Ray; PLACES as usize],
}

impl Rim {
    pub(super) fn at(base_from_cup: &RigidTransform) -> Self {
        let direction = base_from_cup.transform_direction(&Vector3::z());
        let ray = |place: usize| {
            let angle = TAU * place as f64 / f64::from(PLACES);
            let start = Point3::new(RADIUS * angle.cos(), RADIUS * angle.sin(), -LIP);
            let origin = base_from_cup.transform_point(&start);
            Ray { origin, direction }
        };
        Self {
            rays: std::array::from_fn(ray),
        }
    }

    /// The one body whose surface is before the rim all around, as near as it gives way, with nothing between.
    pub(super) fn sealed_on(&self, bodies: &[(usize, Placed<'_>)]) -> Option<usize> {
        let mut sealed = None;
        for ray in &self.rays {
            let (body, way) = nearest(ray, bodies)?;
            let is_near = way >= LIP - COMPLIANCE;
            if !is_near || sealed.is_some_and(|other| other != body) {
                return None;
            }
            sealed = Some(body);
        }
        sealed
    }

    /// Metres that a body reaches into the cup at one place of the rim or more; none where it does not.
    pub(super) fn depth_in(&self, body: &Placed<'_>) -> Option<f64> {
        let ways = self
            .rays
            .iter()
            .filter_map(|ray| body.solid.hit(&body.base_from_solid, ray, LIP));
        ways.map(|way| LIP - way).reduce(f64::max)
    }

    /// Metres that the rim is below z = 0.
    pub(super) fn depth_in_table(&self) -> f64 {
        let lowest = self.rays.iter().map(|ray| ray.at(LIP).z).fold(f64::INFINITY, f64::min);
        (-lowest).max(0.0)
    }
}

/// Which body a ray meets first before the rim's reach ends, and how far it is.
fn nearest(ray: &Ray, bodies: &[(usize, Placed<'_>)]) -> Option<(usize, f64)> {
    let reach = LIP + COMPLIANCE;
    let hit = |(index, body): &(usize, Placed<'_>)| {
        let way = body.solid.hit(&body.base_from_solid, ray, reach)?;
        Some((*index, way))
    };
    bodies.iter().filter_map(hit).min_by(|(_, a), (_, b)| a.total_cmp(b))
}
