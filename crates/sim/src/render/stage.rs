//! The scene prepared for rays.

use std::collections::HashMap;

use geometry::nalgebra::{Point3, Vector3};
use geometry::{Ray, TriangleBvh, TriangleMesh};

use super::random::{hash, unit};
use super::rectangle::Rectangle;
use crate::SimError;
use crate::scene::{Albedo, Scene};

/// Rays start this far off the surface they leave, metres: more than single precision loses, less than a camera sees.
pub(super) const LIFT: f64 = 1e-5;

/// Nothing was met.
pub(super) const NOTHING: u32 = u32::MAX;

/// Normals (in steps of this) and offsets (in steps of a tenth of it) of triangles in one plane agree.
const PLANE_STEP: f64 = 1e-4;

/// A scene, ready for rays. Surfaces are numbered: triangles of all bodies first, then rectangles.
pub(super) struct Stage<'a> {
    pub(super) scene: &'a Scene,
    pub(super) mesh: TriangleMesh,
    pub(super) facets: Vec<Facet>,
    pub(super) rectangles: Vec<Rectangle>,
    bvh: TriangleBvh,
    /// For each panel, by rectangle, whether the panel lies wholly in front of it.
    in_front: [Vec<bool>; 7],
}

/// A triangle of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    pub(super) normal: Vector3<f64>,
    pub(super) body: usize,
    /// The same for triangles of one body that lie in one plane.
    pub(super) plane: u32,
}

/// A place on a surface, met by a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) surface: u32,
    /// Along the ray.
    pub(super) distance: f64,
    pub(super) point: Point3<f64>,
    /// On the ray's side.
    pub(super) normal: Vector3<f64>,
    /// False on the black back of a rectangle.
    pub(super) front: bool,
}

impl Place {
    /// Where rays leave from.
    pub(super) fn lifted(&self) -> Point3<f64> {
        self.point + self.normal * LIFT
    }
}

impl<'a> Stage<'a> {
    pub(super) fn new(scene: &'a Scene) -> Result<Self, SimError> {
        let mut mesh = TriangleMesh::default();
        let mut facets = Vec::new();
        for (body, part) in scene.bodies.iter().enumerate() {
            part.mesh.check()?;
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend_from_slice(&part.mesh.vertices);
            mesh.triangles
                .extend(part.mesh.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
            facets.resize(mesh.triangles.len(), body);
        }
        let rectangles = Rectangle::all(&scene.room, &scene.panels);
        let in_front = scene.panels.each_ref().map(|panel| {
            let before = |r: &Rectangle| panel.corners().iter().all(|corner| r.height(corner) > 0.0);
            rectangles.iter().map(before).collect()
        });
        Ok(Self {
            scene,
            facets: facets_of(&mesh, &facets),
            bvh: TriangleBvh::new(&mesh)?,
            mesh,
            rectangles,
            in_front,
        })
    }

    /// The first surface a ray meets.
    pub(super) fn closest(&self, ray: &Ray) -> Option<Place> {
        let mut limit = f64::INFINITY;
        let mut surface = NOTHING;
        for (index, rectangle) in self.rectangles.iter().enumerate() {
            if let Some(distance) = rectangle.meet(ray).filter(|&distance| distance < limit) {
                limit = distance;
                surface = (self.facets.len() + index) as u32;
            }
        }
        if let Some(hit) = self.bvh.closest_hit(ray, limit) {
            (limit, surface) = (hit.distance, hit.triangle);
        }
        (surface != NOTHING).then(|| self.place(ray, limit, surface))
    }

    /// The place where a ray is known to meet a surface.
    pub(super) fn place(&self, ray: &Ray, distance: f64, surface: u32) -> Place {
        let outward = self.normal(surface);
        let front = outward.dot(&ray.direction) <= 0.0;
        Place {
            surface,
            distance,
            point: ray.at(distance),
            normal: if front { outward } else { -outward },
            front: front || self.body(surface).is_some(),
        }
    }

    fn normal(&self, surface: u32) -> Vector3<f64> {
        match self.facets.get(surface as usize) {
            Some(facet) => facet.normal,
            None => self.rectangle(surface).normal,
        }
    }

    /// Of a triangle.
    pub(super) fn area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.mesh.corners(triangle);
        (b - a).cross(&(c - a)).norm() / 2.0
    }

    /// The rectangle that such a surface is.
    pub(super) fn rectangle(&self, surface: u32) -> &Rectangle {
        &self.rectangles[surface as usize - self.facets.len()]
    }

    /// The body a surface belongs to; none for the room and the panels.
    pub(super) fn body(&self, surface: u32) -> Option<usize> {
        self.facets.get(surface as usize).map(|facet| facet.body)
    }

    /// The same number for surfaces of one body in one plane.
    pub(super) fn plane(&self, surface: u32) -> u32 {
        self.facets.get(surface as usize).map_or(surface, |facet| facet.plane)
    }

    /// Share of light that a place reflects.
    pub(super) fn albedo(&self, place: &Place) -> f64 {
        match self.body(place.surface) {
            Some(body) => self.body_albedo(body, &place.point),
            None if place.front => self.rectangle(place.surface).albedo,
            None => 0.0,
        }
    }

    fn body_albedo(&self, body: usize, point: &Point3<f64>) -> f64 {
        let body = &self.scene.bodies[body];
        match body.albedo {
            Albedo::Uniform(albedo) => albedo,
            Albedo::Print {
                seed,
                cell,
                range: [low, high],
            } => {
                let local = body.base_from_body.inverse().transform_point(point);
                let cells = [local.x, local.y].map(|x| (x / cell).floor() as i64 as u64);
                low + (high - low) * unit(hash(seed, &cells))
            }
        }
    }

    /// What a place shines by itself: which panel, and how bright.
    pub(super) fn emission(&self, place: &Place) -> Option<(usize, f64)> {
        if place.front && self.body(place.surface).is_none() {
            let panel = self.rectangle(place.surface).panel?;
            return Some((panel, self.scene.panels[panel].radiance));
        }
        None
    }

    /// The rectangles that can stand between a place and a panel: not those that have both in front of them.
    pub(super) fn blockers(&self, from: &Point3<f64>, panel: usize) -> Blockers {
        let mut mask = 0;
        for (index, rectangle) in self.rectangles.iter().enumerate().take(Blockers::MOST) {
            let apart = !(self.in_front[panel][index] && rectangle.height(from) > 0.0);
            if apart && rectangle.panel != Some(panel) {
                mask |= 1 << index;
            }
        }
        Blockers(mask)
    }

    /// Whether something stands between two points.
    pub(super) fn blocked(&self, from: &Point3<f64>, to: &Point3<f64>, blockers: Blockers) -> bool {
        let ray = Ray::between(from, to);
        let mut mask = blockers.0;
        while mask != 0 {
            let rectangle = &self.rectangles[mask.trailing_zeros() as usize];
            if rectangle.meet(&ray).is_some_and(|distance| distance < 1.0) {
                return true;
            }
            mask &= mask - 1;
        }
        self.bvh.any_hit(&ray, 1.0)
    }
}

/// A set of rectangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blockers(u64);

impl Blockers {
    const MOST: usize = 64;
}

fn facets_of(mesh: &TriangleMesh, bodies: &[usize]) -> Vec<Facet> {
    let mut planes = HashMap::new();
    let facet = |(triangle, &body): (usize, &usize)| {
        let [a, b, c] = mesh.corners(triangle);
        let across = (b - a).cross(&(c - a));
        let normal = across.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let step = |value: f64| (value / PLANE_STEP).round() as i64;
        let key = (
            body,
            step(normal.x),
            step(normal.y),
            step(normal.z),
            step(normal.dot(&a.coords) * 10.0),
        );
        // The number of a plane is that of its first triangle.
        let plane = *planes.entry(key).or_insert(triangle as u32);
        Facet { normal, body, plane }
    };
    bodies.iter().enumerate().map(facet).collect()
}
