//! The `objects:` of a world file.

use std::collections::HashSet;
use std::fmt;
use std::path::Path;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use super::file::within;
use super::pose::PoseFile;
use crate::SimError;
use crate::objects::Shape;
use crate::scene::{Albedo, Body};

/// Labels are bytes, and 0 is the room.
const MOST_OBJECTS: usize = 255;
/// Objects stand in the middle of the mat unless a pose is given.
const PLACE: [f64; 3] = [0.43, 0.0, 0.0];
/// Of matte white plastic.
const WHITE: f64 = 0.85;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObjectFile {
    name: Option<String>,
    shape: Shape,
    #[serde(default)]
    pose: PoseFile,
    #[serde(default)]
    albedo: AlbedoFile,
}

#[derive(Debug, Clone, Copy)]
enum AlbedoFile {
    Uniform(f64),
    Print(PrintFile),
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct PrintFile {
    print: u64,
    #[serde(default = "default_cell")]
    cell: f64,
    #[serde(default = "default_range")]
    range: [f64; 2],
}

fn default_cell() -> f64 {
    0.000_7
}

fn default_range() -> [f64; 2] {
    [0.15, WHITE]
}

impl Default for AlbedoFile {
    fn default() -> Self {
        Self::Uniform(WHITE)
    }
}

pub(super) fn bodies(objects: &[ObjectFile], folder: &Path) -> Result<Vec<Body>, SimError> {
    require_few(objects.len())?;
    let mut names = HashSet::new();
    let mut bodies = Vec::with_capacity(objects.len());
    for (index, object) in objects.iter().enumerate() {
        let place = format!("objects[{index}]");
        let body = object.resolve(index, folder).map_err(|error| error.within(&place))?;
        if !names.insert(body.name.clone()) {
            return Err(SimError::value(
                place + ".name",
                body.name,
                "a name that no other object has",
            ));
        }
        bodies.push(body);
    }
    Ok(bodies)
}

pub(super) fn require_few(objects: usize) -> Result<(), SimError> {
    if objects <= MOST_OBJECTS {
        return Ok(());
    }
    let found = format!("a list of {objects}");
    Err(SimError::value("objects", found, format!("at most {MOST_OBJECTS}")))
}

impl ObjectFile {
    fn resolve(&self, index: usize, folder: &Path) -> Result<Body, SimError> {
        let base_from_body = self.pose.resolve(PLACE).map_err(|error| error.within("pose"))?;
        let mesh = self.shape.mesh(folder).map_err(|error| error.within("shape"))?;
        Ok(Body {
            name: self.name.clone().unwrap_or_else(|| format!("object {}", index + 1)),
            mesh: mesh.transformed(&base_from_body),
            base_from_body,
            albedo: self.albedo.resolve().map_err(|error| error.within("albedo"))?,
        })
    }
}

impl AlbedoFile {
    fn resolve(self) -> Result<Albedo, SimError> {
        match self {
            Self::Uniform(albedo) => {
                within("value", albedo, 0.0, 1.0)?;
                Ok(Albedo::Uniform(albedo))
            }
            Self::Print(PrintFile { print, cell, range }) => {
                within("cell", cell, 1e-5, 1.0)?;
                within("range[0]", range[0], 0.0, 1.0)?;
                within("range[1]", range[1], range[0], 1.0)?;
                Ok(Albedo::Print {
                    seed: print,
                    cell,
                    range,
                })
            }
        }
    }
}

/// A number, or the parameters of a print.
impl<'de> Deserialize<'de> for AlbedoFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AlbedoVisitor)
    }
}

struct AlbedoVisitor;

impl<'de> Visitor<'de> for AlbedoVisitor {
    type Value = AlbedoFile;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an albedo: a number, or {print: seed, cell: metres, range: [least, most]}")
    }

    fn visit_f64<E: Error>(self, albedo: f64) -> Result<AlbedoFile, E> {
        Ok(AlbedoFile::Uniform(albedo))
    }

    fn visit_u64<E: Error>(self, albedo: u64) -> Result<AlbedoFile, E> {
        self.visit_f64(albedo as f64)
    }

    fn visit_i64<E: Error>(self, albedo: i64) -> Result<AlbedoFile, E> {
        self.visit_f64(albedo as f64)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AlbedoFile, A::Error> {
        PrintFile::deserialize(MapAccessDeserializer::new(map)).map(AlbedoFile::Print)
    }
}
