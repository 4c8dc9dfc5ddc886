//! Renders captures of ten objects, with truth, in the form of path-traced ones, for evaluations:
//!
//! ```text
//! cargo run --release -p sim --example 01_scenes -- ../shared/data/meshes scenes [NAME...]
//! cargo run --release -p rakelight -- eval normals --truth scenes
//! ```
//!
//! Beside the objects there are twelve placements of the calibration target.

use std::error::Error;
use std::path::{Path, PathBuf};

use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};
use geometry::{RigidTransform, TriangleMesh};
use imaging::{Image, Mask};
use rig_scenes::{Hemisphere, SceneView, Truth, write_scene};
use sim::objects::{Ball, MeshFile, Shape};
use sim::render::{RenderOptions, RenderedView, render};
use sim::scene::{AMBIENT_RADIANCE, Albedo, Body, Panel, Room, Scene, View};
use sim::sensor::{Exposure, LightState, Region, Sensor};

/// Digital numbers of the brightest object pixels: 80 % of full scale.
const BRIGHTEST: f64 = 0.8 * 65_535.0;
const SECONDS: f64 = 0.0025;
const WHITE: Albedo = Albedo::Uniform(0.85);
/// Where the target stands over the mat.
const PLACEMENTS: [[f64; 2]; 12] = [
    [0.26, -0.25],
    [0.26, -0.05],
    [0.26, 0.15],
    [0.37, -0.15],
    [0.37, 0.05],
    [0.37, 0.25],
    [0.49, -0.25],
    [0.49, -0.05],
    [0.49, 0.15],
    [0.60, -0.15],
    [0.60, 0.05],
    [0.60, 0.25],
];

/// An object to look at.
struct Subject {
    name: &'static str,
    shape: Shape,
    up: Up,
    albedo: Albedo,
    turn_degrees: f64,
}

/// The axis of a mesh that points up.
#[derive(Clone, Copy, PartialEq)]
enum Up {
    Y,
    Z,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(meshes), Some(out)) = (arguments.next(), arguments.next()) else {
        return Err("usage: 01_scenes FOLDER_OF_MESHES OUTPUT [NAME...]".into());
    };
    let (meshes, out) = (PathBuf::from(meshes), PathBuf::from(out));
    let wanted: Vec<String> = arguments.collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|word| word == name);
    for subject in subjects()? {
        if is_wanted(subject.name) {
            write_subject(&meshes, &out, subject)?;
        }
    }
    for (number, [x, y]) in PLACEMENTS.into_iter().enumerate() {
        if is_wanted("hemispheres") {
            write_target(&out.join(format!("calibration/hemi{number:02}")), number as u64, [x, y])?;
        }
    }
    Ok(())
}

/// The ten objects; meshes stand upright and are 80 to 90 mm high.
fn subjects() -> Result<Vec<Subject>, Box<dyn Error>> {
    let print = Albedo::Print {
        seed: 5,
        cell: 0.002,
        range: [0.3, 0.85],
    };
    let by_code = |name, kind: &str, albedo, turn_degrees| -> Result<Subject, Box<dyn Error>> {
        Ok(Subject {
            name,
            shape: serde_json::from_value(kind.into())?,
            up: Up::Z,
            albedo,
            turn_degrees,
        })
    };
    let mesh = |name, file: &str, scale, up| Subject {
        name,
        shape: Shape::Mesh(MeshFile {
            file: file.into(),
            scale,
        }),
        up,
        albedo: WHITE,
        turn_degrees: 30.0,
    };
    Ok(vec![
        by_code("pyramid", "pyramid", WHITE, 21.0)?,
        by_code("octagon1", "octagon1", WHITE, 10.0)?,
        by_code("octagon2", "octagon2", WHITE, 10.0)?,
        by_code("star", "star", WHITE, 15.0)?,
        by_code("bent_cylinder", "bent_cylinder", WHITE, 40.0)?,
        by_code("relief", "relief", WHITE, 0.0)?,
        by_code("pyramid_textured", "pyramid", print, 21.0)?,
        mesh("spot", "spot.obj", 0.05, Up::Y),
        mesh("bunny", "stanford-bunny.obj", 0.55, Up::Y),
        mesh("buddha", "happy_buddha_lowres.obj", 0.00018, Up::Z),
    ])
}

fn write_subject(meshes: &Path, out: &Path, subject: Subject) -> Result<(), Box<dyn Error>> {
    let mut mesh = subject.shape.mesh(meshes)?;
    if matches!(subject.shape, Shape::Mesh(_)) {
        mesh = standing(&mesh, subject.up);
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), subject.turn_degrees.to_radians());
    let base_from_body = RigidTransform::from_parts(Vector3::new(0.433, -0.004, 0.0), turn);
    let body = Body {
        name: subject.name.to_owned(),
        mesh: mesh.transformed(&base_from_body),
        base_from_body,
        albedo: subject.albedo,
    };
    let views = [("C1", View::rig_c1()?), ("C2", View::rig_c2()?)];
    write(
        &out.join("objects").join(subject.name),
        subject.name,
        None,
        body,
        &views,
        1,
    )
}

/// A mesh turned upright, standing on z = 0 over the origin.
fn standing(mesh: &TriangleMesh, up: Up) -> TriangleMesh {
    let angle = if up == Up::Y { std::f64::consts::FRAC_PI_2 } else { 0.0 };
    let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
    let turned = mesh.transformed(&RigidTransform::from_parts(Vector3::zeros(), upright));
    let corners = || turned.vertices.iter().map(|vertex| vertex.coords);
    let low = corners().fold(Vector3::repeat(f64::INFINITY), |a, b| a.inf(&b));
    let high = corners().fold(Vector3::repeat(f64::NEG_INFINITY), |a, b| a.sup(&b));
    let middle = (low + high) / 2.0;
    let shift = Vector3::new(-middle.x, -middle.y, -low.z);
    turned.transformed(&RigidTransform::from_parts(shift, UnitQuaternion::identity()))
}

/// The target, seen by cameras that stand over it as they do over the middle of the mat.
fn write_target(folder: &Path, seed: u64, [x, y]: [f64; 2]) -> Result<(), Box<dyn Error>> {
    let shape = Shape::Hemisphere(Ball {
        radius: Some(0.04),
        segments: Some(400),
    });
    let centre = Vector3::new(x, y, 0.0);
    let base_from_body = RigidTransform::from_parts(centre, UnitQuaternion::identity());
    let body = Body {
        name: "hemisphere".to_owned(),
        mesh: shape.mesh(folder)?.transformed(&base_from_body),
        base_from_body,
        albedo: WHITE,
    };
    let shift = RigidTransform::from_parts(centre - Vector3::new(0.43, 0.0, 0.0), UnitQuaternion::identity());
    let over = |view: View| View {
        base_from_camera: shift * view.base_from_camera,
        ..view
    };
    let views = [("C1", over(View::rig_c1()?)), ("C2", over(View::rig_c2()?))];
    let hemisphere = Hemisphere {
        centre: Point3::from(centre),
        radius: 0.04,
    };
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned());
    write(folder, &name.unwrap_or_default(), Some(hemisphere), body, &views, seed)
}

fn write(
    folder: &Path,
    name: &str,
    hemisphere: Option<Hemisphere>,
    body: Body,
    views: &[(&str, View); 2],
    seed: u64,
) -> Result<(), Box<dyn Error>> {
    let scene = Scene {
        bodies: vec![body],
        room: Room::rig(),
        panels: Panel::rig(),
        ambient_radiance: AMBIENT_RADIANCE,
    };
    let mut written = Vec::new();
    for (camera, view) in views {
        let view = View {
            camera: view.camera.binned(2)?,
            ..*view
        };
        let seen = render(&scene, &view, &RenderOptions { seed })?;
        let images = expose(&seen, seed)?;
        let truth = Truth {
            normals: seen.normals,
            depth: seen.depth,
        };
        let view = photometric::View {
            camera: view.camera,
            base_from_camera: view.base_from_camera,
        };
        written.push((*camera, view, images, Mask::from_nonzero(&seen.labels), truth));
    }
    let scene_views: Vec<SceneView<'_>> = written
        .iter()
        .map(|(camera, view, images, mask, truth)| SceneView {
            camera,
            view,
            images,
            mask,
            truth,
        })
        .collect();
    write_scene(folder, name, hemisphere, &scene_views)?;
    println!("{}", folder.display());
    Ok(())
}

/// Dark and lit images, exposed so that the brightest object pixels come to 80 %.
fn expose(seen: &RenderedView, seed: u64) -> Result<Vec<Image<u16>>, Box<dyn Error>> {
    let object = |image: &Image<f32>| -> Vec<f32> {
        let pixels = image.pixels().iter().zip(seen.labels.pixels());
        pixels
            .filter(|(_, label)| **label != 0)
            .map(|(radiance, _)| *radiance)
            .collect()
    };
    let mut brightest: Vec<f32> = seen.lights.iter().flat_map(object).collect();
    brightest.sort_by(f32::total_cmp);
    let at = brightest.len() - 1 - brightest.len() / 1000;
    let radiance = f64::from(brightest.get(at).copied().unwrap_or(1.0));
    let sensor = Sensor {
        dn_per_radiance_second: BRIGHTEST / radiance / SECONDS,
        ..Sensor::default()
    };
    let exposure = Exposure {
        seconds: SECONDS,
        gain_decibels: 0.0,
        black_level: 0,
        averaged: 1,
        region: Region {
            x: 0,
            y: 0,
            width: seen.labels.width(),
            height: seen.labels.height(),
        },
    };
    let image = |light: u8| sensor.expose(seen, LightState::single(light), &exposure, seed * 16 + u64::from(light));
    Ok((0..=7).map(image).collect::<Result<_, _>>()?)
}
