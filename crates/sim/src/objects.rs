//! Objects made by code or read from mesh files, in metres. Each stands on z = 0 of a frame of its own.

use std::fmt;
use std::path::Path;

use geometry::TriangleMesh;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, MapDeserializer};
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use crate::SimError;

mod check;
mod loft;
mod mesh_file;
mod prisms;
mod relief;
mod solids;

pub use mesh_file::MeshFile;
pub use prisms::{Bracket, Cross, Cuboid, Cylinder, Gear, Octagon1, Star};
pub use relief::Relief;
pub use solids::{Ball, BentCylinder, Octagon2, Pyramid, Wedge};

/// The kinds of shape that are made by code: each has a default size.
pub const KINDS_BY_CODE: [&str; 17] = [
    "box",
    "plate",
    "base_plate",
    "disc",
    "cylinder",
    "octagon1",
    "octagon2",
    "star",
    "gear",
    "cross",
    "bracket",
    "pyramid",
    "wedge",
    "sphere",
    "hemisphere",
    "bent_cylinder",
    "relief",
];

/// What an object looks like. In a world file: `shape: pyramid`, or `shape: {kind: pyramid, height: 0.04}`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(remote = "Self", tag = "kind", rename_all = "snake_case")]
pub enum Shape {
    /// 100 x 60 x 40 mm.
    Box(Cuboid),
    /// 100 x 100 x 10 mm.
    Plate(Cuboid),
    /// 150 x 150 x 3 mm, for others to lie on.
    BasePlate(Cuboid),
    /// 50 mm across, 3.15 mm thick.
    Disc(Cylinder),
    /// 50 mm across, 60 mm high.
    Cylinder(Cylinder),
    /// Flat.
    Octagon1(Octagon1),
    /// Stepped.
    Octagon2(Octagon2),
    /// Flat.
    Star(Star),
    /// With a bore.
    Gear(Gear),
    /// Two bars.
    Cross(Cross),
    /// An L.
    Bracket(Bracket),
    /// Four sides.
    Pyramid(Pyramid),
    /// A plane at an angle.
    Wedge(Wedge),
    /// Of radius 30 mm.
    Sphere(Ball),
    /// Of radius 40 mm.
    Hemisphere(Ball),
    /// An arc of a round bar.
    BentCylinder(BentCylinder),
    /// A bas-relief.
    Relief(Relief),
    /// From a file.
    Mesh(MeshFile),
}

impl Shape {
    /// The surface; a file's relative path begins at `folder`.
    pub fn mesh(&self, folder: &Path) -> Result<TriangleMesh, SimError> {
        match self {
            Self::Box(shape) => shape.mesh([0.1, 0.06, 0.04]),
            Self::Plate(shape) => shape.mesh([0.1, 0.1, 0.01]),
            Self::BasePlate(shape) => shape.mesh([0.15, 0.15, 0.003]),
            Self::Disc(shape) => shape.mesh(0.05, 0.003_15),
            Self::Cylinder(shape) => shape.mesh(0.05, 0.06),
            Self::Octagon1(shape) => shape.mesh(),
            Self::Octagon2(shape) => shape.mesh(),
            Self::Star(shape) => shape.mesh(),
            Self::Gear(shape) => shape.mesh(),
            Self::Cross(shape) => shape.mesh(),
            Self::Bracket(shape) => shape.mesh(),
            Self::Pyramid(shape) => shape.mesh(),
            Self::Wedge(shape) => shape.mesh(),
            Self::Sphere(shape) => shape.sphere(),
            Self::Hemisphere(shape) => shape.hemisphere(),
            Self::BentCylinder(shape) => shape.mesh(),
            Self::Relief(shape) => shape.mesh(),
            Self::Mesh(shape) => shape.mesh(folder),
        }
    }
}

/// A kind alone stands for its default size.
impl<'de> Deserialize<'de> for Shape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ShapeVisitor)
    }
}

struct ShapeVisitor;

impl<'de> Visitor<'de> for ShapeVisitor {
    type Value = Shape;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a shape: its kind, or {kind: ..., parameters}")
    }

    fn visit_str<E: Error>(self, kind: &str) -> Result<Shape, E> {
        // The derived reader, which takes a map.
        Shape::deserialize(MapDeserializer::new(std::iter::once(("kind", kind))))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Shape, A::Error> {
        Shape::deserialize(MapAccessDeserializer::new(map))
    }
}
