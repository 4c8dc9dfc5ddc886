//! Writing scenes in the same form.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use half::f16;
use imaging::{Image, Mask, encode_png};
use npyz::{AutoSerialize, WriterBuilder};
use photometric::View;
use serde_json::json;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::error::SceneError;
use crate::scene::Hemisphere;
use crate::view::Truth;

/// One camera's part of a scene to write.
#[derive(Debug)]
pub struct SceneView<'a> {
    /// `C1` or `C2`.
    pub camera: &'a str,
    /// From where.
    pub view: &'a View,
    /// Dark, then L1, L2, ...
    pub images: &'a [Image<u16>],
    /// The object.
    pub mask: &'a Mask,
    /// Normals and depth.
    pub truth: &'a Truth,
}

/// Writes a scene into a folder, which is made if it is missing.
pub fn write_scene(
    folder: &Path,
    name: &str,
    hemisphere: Option<Hemisphere>,
    views: &[SceneView<'_>],
) -> Result<(), SceneError> {
    for view in views {
        let own = folder.join(view.camera);
        std::fs::create_dir_all(&own).map_err(|source| SceneError::Read {
            path: own.clone(),
            source,
        })?;
        for (image, file) in view.images.iter().zip(image_names()) {
            put_png(&own.join(format!("{file}.png")), encode_png(image))?;
        }
        put_png(&own.join("mask.png"), encode_png(view.mask.as_image()))?;
        put_truth(&own.join("gt.npz"), view.truth)?;
    }
    let path = folder.join("scene.json");
    let text = serde_json::to_string_pretty(&description(name, hemisphere, views))
        .map_err(|error| SceneError::content(&path, error))?;
    put(&path, text.as_bytes())
}

fn image_names() -> impl Iterator<Item = String> {
    std::iter::once("dark".to_owned()).chain((1..).map(|light| format!("L{light}")))
}

fn description(name: &str, hemisphere: Option<Hemisphere>, views: &[SceneView<'_>]) -> serde_json::Value {
    let object = hemisphere.map_or_else(
        || json!({"role": "object"}),
        |target| json!({"role": "object", "centre_m": target.centre.coords.as_slice(), "radius_m": target.radius}),
    );
    let view = |view: &SceneView<'_>| {
        let camera = &view.view.camera;
        let ([fx, fy], [cx, cy]) = (camera.focal(), camera.principal());
        let lens = camera.distortion();
        let rotation = view.view.rotation();
        let centre = view.view.centre();
        let row = |r: usize| [rotation[(r, 0)], rotation[(r, 1)], rotation[(r, 2)], centre[r]];
        let order: Vec<String> = image_names().take(view.images.len()).collect();
        json!({
            "camera": view.camera,
            "size": [camera.width(), camera.height()],
            "K": [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]],
            "dist_k1k2": [lens.k1, lens.k2],
            "T_base_cam": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
            "image_order": order,
        })
    };
    json!({
        "scene": name,
        "objects": [object],
        "views": views.iter().map(view).collect::<Vec<_>>(),
    })
}

fn put_png<E: std::fmt::Display>(path: &Path, png: Result<Vec<u8>, E>) -> Result<(), SceneError> {
    put(path, &png.map_err(|error| SceneError::content(path, error))?)
}

fn put(path: &Path, bytes: &[u8]) -> Result<(), SceneError> {
    std::fs::write(path, bytes).map_err(|source| SceneError::Read {
        path: path.to_owned(),
        source,
    })
}

fn put_truth(path: &Path, truth: &Truth) -> Result<(), SceneError> {
    let wrong = |error: std::io::Error| SceneError::content(path, error);
    let file = File::create(path).map_err(|source| SceneError::Read {
        path: path.to_owned(),
        source,
    })?;
    let mut archive = ZipWriter::new(BufWriter::new(file));
    let [width, height] = [truth.depth.width() as u64, truth.depth.height() as u64];
    let zero = |value: f32| if value.is_nan() { 0.0 } else { value };
    let normals = truth.normals.pixels().iter().flatten().map(|&n| f16::from_f32(zero(n)));
    let depths = truth.depth.pixels().iter().map(|&z| zero(z));
    put_array(&mut archive, "normal_world", &[height, width, 3], normals).map_err(wrong)?;
    put_array(&mut archive, "depth", &[height, width], depths).map_err(wrong)?;
    archive.finish().map_err(|error| SceneError::content(path, error))?;
    Ok(())
}

fn put_array<T: AutoSerialize>(
    archive: &mut ZipWriter<BufWriter<File>>,
    name: &str,
    shape: &[u64],
    values: impl Iterator<Item = T>,
) -> std::io::Result<()> {
    archive
        .start_file(format!("{name}.npy"), SimpleFileOptions::default())
        .map_err(std::io::Error::other)?;
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(shape)
        .writer(&mut bytes)
        .begin_nd()?;
    writer.extend(values)?;
    writer.finish()?;
    archive.write_all(&bytes)
}
