//! The `scatter:` of a world file: clutter drawn at random.

use std::collections::HashSet;
use std::path::Path;

use geometry::RigidTransform;
use geometry::nalgebra::{Point2, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::World;
use super::file::within;
use super::objects::require_few;
use crate::SimError;
use crate::scene::{Albedo, Body};
use draw::{Draw, draw};

mod draw;

pub use draw::KINDS_TO_SCATTER;

/// How often a place is looked for before everything is laid anew, and how often that.
const TRIES: [u32; 2] = [400, 50];

/// Objects that stand on the table without touching each other, inside what both cameras see. The same numbers give the
/// same objects.
///
/// Sizes are drawn from what a hand-sized cup can hold (25 to 95 mm across, 3 to 30 mm high), albedos from matte
/// plastics; a third of them is printed. Each stands on its base, turned at random.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scatter {
    /// Which draw.
    pub seed: u64,
    /// How many objects.
    pub count: u32,
    /// Of which kinds, of [`KINDS_TO_SCATTER`]; each comes once before one comes again. None: all of them.
    pub shapes: Vec<String>,
    /// Where.
    pub region: Region,
    /// From one to the next at least, metres.
    pub clearance: f64,
}

/// A square on the table, along the base's axes. Metres.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Region {
    /// Of its middle.
    pub x: f64,
    /// Of its middle.
    pub y: f64,
    /// Of its sides.
    pub size: f64,
}

impl Default for Region {
    /// What both cameras of the rig see, and some.
    fn default() -> Self {
        Self {
            x: 0.43,
            y: 0.0,
            size: 0.18,
        }
    }
}

impl Default for Scatter {
    fn default() -> Self {
        Self {
            seed: 1,
            count: 5,
            shapes: Vec::new(),
            region: Region::default(),
            clearance: 0.004,
        }
    }
}

/// A circle on the table that holds an object, or part of one.
#[derive(Debug, Clone, Copy)]
struct Footprint {
    centre: Point2<f64>,
    radius: f64,
}

impl World {
    /// The rig with an arm's flange and cameras as they are, and clutter on the table.
    pub fn scattered(scatter: &Scatter) -> Result<Self, SimError> {
        let mut world = Self::from_yaml("", Path::new(""))?;
        world.scene.bodies = scatter.bodies(&[]).map_err(|error| error.within("scatter"))?;
        Ok(world)
    }
}

impl Scatter {
    /// The objects, beside those that stand there already.
    ///
    /// # Errors
    /// Values that cannot be, an unknown kind, or more objects than have place.
    pub fn bodies(&self, standing: &[Body]) -> Result<Vec<Body>, SimError> {
        self.check()?;
        let names: HashSet<&str> = standing.iter().map(|body| body.name.as_str()).collect();
        let taken: Vec<Footprint> = standing.iter().map(footprint).collect();
        let mut random = fastrand::Rng::with_seed(self.seed);
        for _ in 0..TRIES[1] {
            let draws = self.draws(&mut random)?;
            if let Some(places) = self.places(&draws, &taken, &mut random) {
                let bodies = draws.into_iter().zip(places).enumerate();
                return Ok(bodies
                    .map(|(index, (draw, place))| body(index, draw, &place, &names))
                    .collect());
            }
        }
        let found = format!("{} objects in {} m", self.count, self.region.size);
        Err(SimError::value("count", found, "as many as have place in the region"))
    }

    fn check(&self) -> Result<(), SimError> {
        require_few(self.count as usize)?;
        within("region.x", self.region.x, -10.0, 10.0)?;
        within("region.y", self.region.y, -10.0, 10.0)?;
        within("region.size", self.region.size, 0.05, 10.0)?;
        within("clearance", self.clearance, 0.0, 0.5)?;
        let unknown = |kind: &&String| !KINDS_TO_SCATTER.contains(&kind.as_str());
        match self.shapes.iter().find(unknown) {
            Some(kind) => Err(SimError::value("shapes", kind.clone(), KINDS_TO_SCATTER.join(", "))),
            None => Ok(()),
        }
    }

    /// Every kind once, in a random order, before one comes again.
    fn draws(&self, random: &mut fastrand::Rng) -> Result<Vec<Draw>, SimError> {
        let all = KINDS_TO_SCATTER.map(str::to_owned);
        let kinds = if self.shapes.is_empty() { &all[..] } else { &self.shapes };
        let mut round: Vec<&str> = Vec::new();
        let mut draws = Vec::new();
        for _ in 0..self.count {
            if round.is_empty() {
                round = kinds.iter().map(String::as_str).collect();
                random.shuffle(&mut round);
            }
            if let Some(kind) = round.pop() {
                draws.push(draw(kind, random)?);
            }
        }
        Ok(draws)
    }

    /// Where each is put and how it is turned; the large ones look for a place first.
    fn places(&self, draws: &[Draw], taken: &[Footprint], random: &mut fastrand::Rng) -> Option<Vec<RigidTransform>> {
        let mut taken = taken.to_vec();
        let mut order: Vec<usize> = (0..draws.len()).collect();
        order.sort_by(|a, b| draws[*b].radius.total_cmp(&draws[*a].radius));
        let mut places = vec![RigidTransform::identity(); draws.len()];
        for index in order {
            let draw = &draws[index];
            let (place, footprint) = (0..TRIES[0])
                .map(|_| self.place(draw, random))
                .find(|(_, footprint)| taken.iter().all(|other| footprint.gap(other) >= self.clearance))?;
            places[index] = place;
            taken.push(footprint);
        }
        Some(places)
    }

    /// Inside the region.
    fn place(&self, draw: &Draw, random: &mut fastrand::Rng) -> (RigidTransform, Footprint) {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), random.f64() * std::f64::consts::TAU);
        let room = (self.region.size / 2.0 - draw.radius).max(0.0);
        let mut along = |middle: f64| middle + room * (2.0 * random.f64() - 1.0);
        let centre = Vector3::new(along(self.region.x), along(self.region.y), 0.0);
        let middle = Vector3::new(draw.middle.x, draw.middle.y, 0.0);
        let footprint = Footprint {
            centre: centre.xy().into(),
            radius: draw.radius,
        };
        (RigidTransform::from_parts(centre - turn * middle, turn), footprint)
    }
}

impl Footprint {
    fn gap(&self, other: &Self) -> f64 {
        (self.centre - other.centre).norm() - self.radius - other.radius
    }
}

fn footprint(body: &Body) -> Footprint {
    let (middle, radius) = draw::circle(&body.mesh);
    Footprint { centre: middle, radius }
}

fn body(index: usize, draw: Draw, base_from_body: &RigidTransform, names: &HashSet<&str>) -> Body {
    let plain = format!("{} {}", draw.kind, index + 1);
    let is_taken = names.contains(plain.as_str());
    Body {
        name: if is_taken { format!("scattered {plain}") } else { plain },
        mesh: draw.mesh.transformed(base_from_body),
        base_from_body: *base_from_body,
        albedo: draw.albedo,
    }
}

impl Draw {
    fn albedo(random: &mut fastrand::Rng) -> Albedo {
        let uniform = 0.5 + 0.38 * random.f64();
        let (is_printed, seed) = (random.u32(0..3) == 0, random.u64(..));
        if is_printed {
            return Albedo::Print {
                seed,
                cell: 0.000_7,
                range: [0.15, 0.85],
            };
        }
        Albedo::Uniform(uniform)
    }
}
