//! How long it takes to render both cameras of the rig after a change of the world. Run with `--release`; a mesh file
//! and its scale may be named: `02_render_speed statue.obj 0.001`.

use std::path::Path;
use std::time::Instant;

use geometry::RigidTransform;
use sim::SimError;
use sim::objects::{MeshFile, Octagon2, Shape};
use sim::render::{RenderOptions, render};
use sim::scene::{AMBIENT_RADIANCE, Albedo, Body, Panel, Room, Scene, View};

fn main() -> Result<(), SimError> {
    let mut arguments = std::env::args().skip(1);
    let shape = match arguments.next() {
        None => Shape::Octagon2(Octagon2::default()),
        Some(file) => Shape::Mesh(MeshFile {
            file: file.into(),
            scale: arguments.next().and_then(|scale| scale.parse().ok()).unwrap_or(1.0),
        }),
    };
    let scene = scene(&shape)?;
    println!("{} triangles", scene.bodies[0].mesh.triangles.len());
    for bin in [2, 1] {
        let started = Instant::now();
        for mut view in [View::rig_c1()?, View::rig_c2()?] {
            view.camera = view.camera.binned(bin)?;
            render(&scene, &view, &RenderOptions::default())?;
        }
        println!("both cameras at {0} x {0}: {1:.2?}", 1536 / bin, started.elapsed());
    }
    Ok(())
}

/// An object in the middle of the mat.
fn scene(shape: &Shape) -> Result<Scene, SimError> {
    let mesh = shape.mesh(Path::new("."))?;
    let lowest = mesh
        .vertices
        .iter()
        .map(|vertex| vertex.z)
        .fold(f64::INFINITY, f64::min);
    let base_from_body = RigidTransform::from_quaternion_xyzw([0.43, 0.0, -lowest], [0.0, 0.0, 0.0, 1.0])?;
    Ok(Scene {
        bodies: vec![Body {
            name: "object".to_owned(),
            mesh: mesh.transformed(&base_from_body),
            base_from_body,
            albedo: Albedo::Uniform(0.85),
        }],
        room: Room::rig(),
        panels: Panel::rig(),
        ambient_radiance: AMBIENT_RADIANCE,
    })
}
