//! Objects from mesh files: Wavefront `.obj`, and `.ply` as text or binary.

use std::ffi::OsStr;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use geometry::TriangleMesh;
use geometry::nalgebra::Point3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use serde::Deserialize;

use crate::SimError;

/// A mesh read from a file. It need not be closed, but is seen only from outside.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// `.obj` or `.ply`; in a world file, relative to its folder.
    pub file: PathBuf,
    /// Metres in a unit of the file.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

impl MeshFile {
    /// Reads it; `folder` is where a relative path begins.
    pub(super) fn mesh(&self, folder: &Path) -> Result<TriangleMesh, SimError> {
        if !(1e-6..=1e6).contains(&self.scale) {
            return Err(SimError::value("scale", self.scale.to_string(), "0.000001 to 1000000"));
        }
        let path = folder.join(&self.file);
        let extension = path.extension().map(OsStr::to_ascii_lowercase);
        let mut mesh = match extension.as_ref().and_then(|extension| extension.to_str()) {
            Some("obj") => read_obj(&path)?,
            Some("ply") => read_ply(&path)?,
            _ => return Err(refuse(&path, "the file's name", "it ends in neither .obj nor .ply")),
        };
        check(&path, &mesh)?;
        for vertex in &mut mesh.vertices {
            *vertex *= self.scale;
        }
        Ok(mesh)
    }
}

fn refuse(path: &Path, place: impl Into<String>, reason: impl Into<String>) -> SimError {
    SimError::Mesh {
        path: path.to_owned(),
        place: place.into(),
        reason: reason.into(),
    }
}

fn open(path: &Path) -> Result<BufReader<File>, SimError> {
    let file = File::open(path).map_err(|reason| SimError::ReadFile {
        path: path.to_owned(),
        reason,
    })?;
    Ok(BufReader::new(file))
}

fn read_obj(path: &Path) -> Result<TriangleMesh, SimError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ..tobj::LoadOptions::default()
    };
    // Materials are not looked at, and files that name one without having it are common.
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut open(path)?, &options, no_materials)
        .map_err(|error| refuse(path, "the file", error.to_string()))?;
    let mut mesh = TriangleMesh::default();
    for model in models {
        let first = mesh.vertices.len() as u32;
        let (corners, _) = model.mesh.positions.as_chunks::<3>();
        mesh.vertices.extend(corners.iter().map(|&[x, y, z]| point(x, y, z)));
        let (triangles, _) = model.mesh.indices.as_chunks::<3>();
        mesh.triangles
            .extend(triangles.iter().map(|triangle| triangle.map(|vertex| first + vertex)));
    }
    Ok(mesh)
}

fn point(x: f32, y: f32, z: f32) -> Point3<f64> {
    Point3::new(f64::from(x), f64::from(y), f64::from(z))
}

fn read_ply(path: &Path) -> Result<TriangleMesh, SimError> {
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut open(path)?)
        .map_err(|error| refuse(path, "the file", error.to_string()))?;
    let element = |name: &str| {
        ply.payload
            .get(name)
            .ok_or_else(|| refuse(path, "the header", format!("there is no element {name:?}")))
    };
    let mut mesh = TriangleMesh::default();
    for (index, vertex) in element("vertex")?.iter().enumerate() {
        let number = |name: &str| {
            let value = vertex.get(name).and_then(Property::to_f32_lossy);
            value.ok_or_else(|| refuse(path, format!("vertex {index}"), format!("it has no number {name:?}")))
        };
        mesh.vertices.push(point(number("x")?, number("y")?, number("z")?));
    }
    for (index, face) in element("face")?.iter().enumerate() {
        let corners = ["vertex_indices", "vertex_index"]
            .iter()
            .find_map(|name| face.get(*name).and_then(Property::to_u32_list))
            .ok_or_else(|| {
                refuse(
                    path,
                    format!("face {index}"),
                    "it has no list \"vertex_indices\" from 0 up",
                )
            })?;
        // A fan; faces of more than three corners are convex in practice.
        for pair in corners.windows(2).skip(1) {
            mesh.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }
    Ok(mesh)
}

fn check(path: &Path, mesh: &TriangleMesh) -> Result<(), SimError> {
    let vertices = mesh.vertices.len();
    if mesh.triangles.is_empty() {
        return Err(refuse(path, "the file", "it has no triangles"));
    }
    let finite = |vertex: &Point3<f64>| vertex.iter().all(|x| x.is_finite());
    // Readers renumber vertices: an index would not be that of the file.
    if let Some(vertex) = mesh.vertices.iter().find(|vertex| !finite(vertex)) {
        let place = format!("the vertex at {:?}", [vertex.x, vertex.y, vertex.z]);
        return Err(refuse(path, place, "it is not finite"));
    }
    let outside = |triangle: &[u32; 3]| triangle.iter().any(|&vertex| vertex as usize >= vertices);
    if let Some(index) = mesh.triangles.iter().position(outside) {
        let reason = format!("it is {:?}, but there are {vertices} vertices", mesh.triangles[index]);
        return Err(refuse(path, format!("triangle {index}"), reason));
    }
    Ok(())
}
