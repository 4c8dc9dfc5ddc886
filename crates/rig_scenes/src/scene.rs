//! A folder with `scene.json`.

use std::path::{Path, PathBuf};

use geometry::nalgebra::Point3;
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use photometric::View;
use serde::Deserialize;

use crate::error::SceneError;
use crate::view::CapturedView;

/// One scene: what stands there and how many cameras saw it.
#[derive(Debug, Clone)]
pub struct SceneFolder {
    folder: PathBuf,
    description: Description,
}

/// A calibration target on the mat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hemisphere {
    /// Base frame, metres; on the mat's plane.
    pub centre: Point3<f64>,
    /// Metres.
    pub radius: f64,
}

#[derive(Debug, Clone, Deserialize)]
struct Description {
    objects: Vec<Object>,
    views: Vec<Entry>,
}

#[derive(Debug, Clone, Deserialize)]
struct Object {
    centre_m: Option<[f64; 3]>,
    radius_m: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
struct Entry {
    camera: String,
    size: [usize; 2],
    #[serde(rename = "K")]
    k: [[f64; 3]; 3],
    #[serde(default)]
    dist_k1k2: [f64; 2],
    #[serde(rename = "T_base_cam")]
    pose: [[f64; 4]; 4],
}

impl SceneFolder {
    /// Reads `scene.json`.
    pub fn open(folder: &Path) -> Result<Self, SceneError> {
        let path = folder.join("scene.json");
        let text = std::fs::read_to_string(&path).map_err(|source| SceneError::Read {
            path: path.clone(),
            source,
        })?;
        let description = serde_json::from_str(&text).map_err(|error| SceneError::content(&path, error))?;
        Ok(Self {
            folder: folder.to_owned(),
            description,
        })
    }

    /// The folder's own name.
    pub fn name(&self) -> String {
        let name = self.folder.file_name().unwrap_or(self.folder.as_os_str());
        name.to_string_lossy().into_owned()
    }

    /// Names of the cameras, `C1` and `C2`.
    pub fn cameras(&self) -> impl Iterator<Item = &str> {
        self.description.views.iter().map(|view| view.camera.as_str())
    }

    /// The target, where the scene is a placement of one.
    pub fn hemisphere(&self) -> Option<Hemisphere> {
        let object = self.description.objects.first()?;
        Some(Hemisphere {
            centre: object.centre_m?.into(),
            radius: object.radius_m?,
        })
    }

    /// Images and truth of every camera.
    pub fn views(&self) -> Result<Vec<CapturedView>, SceneError> {
        let read = |entry: &Entry| {
            let view = entry
                .view()
                .map_err(|error| SceneError::content(self.folder.join("scene.json"), error))?;
            CapturedView::read(&self.folder.join(&entry.camera), entry.camera.clone(), view)
        };
        self.description.views.iter().map(read).collect()
    }
}

impl Entry {
    fn view(&self) -> Result<View, geometry::GeometryError> {
        let [[fx, _, cx], [_, fy, cy], _] = self.k;
        let [k1, k2] = self.dist_k1k2;
        let lens = PlumbBob {
            k1,
            k2,
            ..PlumbBob::default()
        };
        let camera = PinholeCamera::new(self.size[0], self.size[1], [fx, fy], [cx, cy])?;
        Ok(View {
            camera: camera.with_distortion(lens),
            base_from_camera: RigidTransform::from_matrix(&self.pose)?,
        })
    }
}

/// Folders with a `scene.json`, there and up to two folders below, in the order of their paths.
pub fn find_scenes(folder: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let mut found = Vec::new();
    collect(folder, 2, &mut found)?;
    found.sort();
    if found.is_empty() {
        return Err(SceneError::content(
            folder,
            "no scene: looked for scene.json there and up to two folders below",
        ));
    }
    Ok(found)
}

fn collect(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), SceneError> {
    if folder.join("scene.json").is_file() {
        found.push(folder.to_owned());
        return Ok(());
    }
    let failed = |source| SceneError::Read {
        path: folder.to_owned(),
        source,
    };
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if depth > 0 && path.is_dir() {
            collect(&path, depth - 1, found)?;
        }
    }
    Ok(())
}
