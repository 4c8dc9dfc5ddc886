//! Shadows of a rendered scene, and that rendering it again changes nothing.

use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3};
use sim::render::{RenderOptions, RenderedView, render};
use sim::scene::View;
use sim::world::World;

/// A block on the mat, seen by C1 with every eighth pixel.
const WORLD: &str = "
objects:
  - shape: box
    pose: {x: 0.43, y: 0.0, yaw: 0.4}
    albedo: 0.85
";
const BINNING: u32 = 8;

fn block() -> (World, View) {
    let world = World::from_yaml(WORLD, "".as_ref()).expect("the world is good");
    let camera = world.camera("c1").expect("C1");
    let view = world
        .view(camera, [BINNING; 2])
        .expect("the binning divides the sensor");
    (world, view)
}

fn rendered(threads: usize) -> RenderedView {
    let (world, view) = block();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads");
    pool.install(|| render(&world.scene, &view, &RenderOptions { seed: 1 }))
        .expect("the scene is good")
}

#[test]
fn any_number_of_threads_gives_the_same_image() {
    let (one, three) = (rendered(1), rendered(3));
    assert_eq!(one.ambient, three.ambient);
    assert_eq!(one.lights, three.lights);
    assert_eq!(one.labels, three.labels);
}

/// Away from the block a shadow's edge is wide: neighbouring pixels of the mat differ little everywhere.
#[test]
fn a_penumbra_has_no_step() {
    let view = rendered(2);
    let (width, height) = (view.labels.width(), view.labels.height());
    let mat = |x: usize, y: usize| {
        (x.saturating_sub(FAR)..(x + FAR).min(width))
            .all(|column| (y.saturating_sub(FAR)..(y + FAR).min(height)).all(|row| view.labels.row(row)[column] == 0))
    };
    for (number, light) in (1..).zip(&view.lights).take(6) {
        let brightest = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .filter(|&(x, y)| mat(x, y))
            .map(|(x, y)| light.row(y)[x])
            .fold(0.0_f32, f32::max);
        let mut largest = 0.0_f32;
        let mut darkest = f32::MAX;
        for y in 1..height {
            for x in (1..width).filter(|&x| mat(x, y) && mat(x - 1, y) && mat(x, y - 1)) {
                let here = light.row(y)[x];
                let step = (here - light.row(y)[x - 1])
                    .abs()
                    .max((here - light.row(y - 1)[x]).abs());
                largest = largest.max(step / brightest);
                darkest = darkest.min(here / brightest);
            }
        }
        println!(
            "L{number}: steps of {:.1} % at most, {:.0} % in the dark",
            100.0 * largest,
            100.0 * darkest
        );
        assert!(largest < 0.1, "L{number}");
        assert!(darkest < 0.5, "L{number}: there is a shadow");
    }
}

/// Pixels around the block that are left out: there a shadow's edge is narrow.
const FAR: usize = 16;

/// Turning everything about the middle of the mat by a sixth of a turn turns the light from one panel to the next.
#[test]
fn the_hexagon_is_symmetric() {
    let (world, view) = block();
    let mut scene = world.scene;
    scene.room.walls.clear();
    let middle = Vector3::new(0.43, 0.0, 0.0);
    let turn = RigidTransform::from_parts(Vector3::zeros(), UnitQuaternion::from_euler_angles(0.0, 0.0, TURN));
    let away = RigidTransform::from_parts(-middle, UnitQuaternion::identity());
    let about_middle = away.inverse() * turn * away;
    for panel in &mut scene.panels {
        panel.radiance = 1.0;
    }
    let first = render(&scene, &view, &RenderOptions { seed: 1 }).expect("the scene is good");
    for body in &mut scene.bodies {
        body.mesh = body.mesh.transformed(&about_middle);
        body.base_from_body = about_middle * body.base_from_body;
    }
    let turned = View {
        base_from_camera: about_middle * view.base_from_camera,
        ..view
    };
    let second = render(&scene, &turned, &RenderOptions { seed: 1 }).expect("the scene is good");
    for light in 0..6 {
        let (mut sum, mut difference, mut count) = (0.0, 0.0, 0);
        let pixels = first.lights[light]
            .pixels()
            .iter()
            .zip(second.lights[(light + 1) % 6].pixels());
        for ((before, after), label) in pixels.zip(first.labels.pixels()) {
            if *label > 0 {
                sum += f64::from(*before);
                difference += f64::from((before - after).abs());
                count += 1;
            }
        }
        assert!(count > 100);
        println!("L{}: {:.4} % apart", light + 1, 100.0 * difference / sum);
        assert!(
            difference < 0.001 * sum,
            "the mat around the block is all it sees of the table"
        );
    }
}

const TURN: f64 = std::f64::consts::FRAC_PI_3;
