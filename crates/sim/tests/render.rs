//! What the cameras see of scenes whose light is known by other means.

use std::f64::consts::PI;

use geometry::nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};
use geometry::{PinholeCamera, PlumbBob, RigidTransform, TriangleMesh};
use sim::render::{RenderOptions, RenderedView, render};
use sim::scene::{AMBIENT_RADIANCE, Albedo, Body, Panel, Room, Scene, View, Wall};

/// A camera at a place that looks at another, the image's right side along base x when it looks down.
fn looking(from: [f64; 3], at: [f64; 3], size: usize, focal: f64) -> View {
    let (from, at) = (Vector3::from(from), Vector3::from(at));
    let forward = (at - from).normalize();
    let right = (Vector3::x() - forward * forward.x).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let middle = (size as f64 - 1.0) / 2.0;
    View {
        camera: PinholeCamera::new(size, size, [focal, focal], [middle, middle]).unwrap(),
        base_from_camera: RigidTransform::from_parts(from, rotation),
    }
}

fn down() -> View {
    looking([0.43, 0.0, 0.4], [0.43, 0.0, 0.0], 64, 120.0)
}

/// Twelve triangles around a cuboid, outsides out.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> TriangleMesh {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
        Point3::new(pick(0), pick(1), pick(2))
    };
    let sides: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    TriangleMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

fn body(mesh: TriangleMesh, albedo: f64) -> Body {
    Body {
        name: "body".to_owned(),
        mesh,
        base_from_body: RigidTransform::identity(),
        albedo: Albedo::Uniform(albedo),
    }
}

fn block() -> Body {
    body(cuboid([0.40, -0.03, 0.0], [0.46, 0.03, 0.05]), 0.85)
}

fn rig(bodies: Vec<Body>) -> Scene {
    Scene {
        bodies,
        room: Room::rig(),
        panels: Panel::rig(),
        ambient_radiance: AMBIENT_RADIANCE,
    }
}

/// The rig without anything around the mat, and a mat that reflects nothing.
fn bare(bodies: Vec<Body>) -> Scene {
    let mut scene = rig(bodies);
    scene.room.walls.clear();
    scene.room.mat_albedo = 0.0;
    scene.room.table_albedo = 0.0;
    scene.ambient_radiance = 0.0;
    scene
}

fn rendered(scene: &Scene, view: &View) -> RenderedView {
    render(scene, view, &RenderOptions { seed: 3 }).unwrap()
}

fn at(image: &imaging::Image<f32>, x: usize, y: usize) -> f64 {
    f64::from(*image.get(x, y).unwrap())
}

#[test]
fn in_a_white_furnace_every_surface_looks_the_same() {
    // Ambient light comes from everywhere and nothing is absorbed: whatever is seen must be as bright as the light itself,
    // or the bounces lose or invent some.
    let mut scene = bare(vec![block()]);
    scene.bodies[0].albedo = Albedo::Uniform(1.0);
    // Panels absorb: make them too small to matter.
    scene.panels.iter_mut().for_each(|panel| panel.size = [1e-6, 1e-6]);
    scene.room.mat_albedo = 1.0;
    scene.room.table_albedo = 1.0;
    scene.room.mat_size = [40.0, 40.0];
    scene.room.table_size = [41.0, 41.0];
    scene.ambient_radiance = 0.7;
    let view = rendered(&scene, &down());
    for &radiance in view.ambient.pixels() {
        assert!((f64::from(radiance) / 0.7 - 1.0).abs() < 0.02, "{radiance}");
    }
}

#[test]
fn a_level_patch_under_the_overhead_panel_has_the_irradiance_of_a_sum_over_the_panel() {
    let mut scene = bare(Vec::new());
    scene.room.mat_albedo = 0.5;
    let view = rendered(&scene, &down());
    let panel = scene.panels[6];
    let point = Point3::new(0.43, 0.0, 0.0);
    let mut irradiance = 0.0;
    for i in 0..50 {
        for j in 0..50 {
            let along = |k: i32, side: f64| ((f64::from(k) + 0.5) / 50.0 - 0.5) * side;
            let to = panel.centre + Vector3::new(along(j, panel.size[1]), along(i, panel.size[0]), 0.0) - point;
            let cosine = to.z / to.norm();
            irradiance += panel.radiance * cosine * cosine / to.norm_squared();
        }
    }
    irradiance *= panel.size[0] * panel.size[1] / 2500.0;
    let found = at(&view.lights[6], 32, 32);
    assert!((found / (0.5 / PI * irradiance) - 1.0).abs() < 1e-3, "{found}");
}

#[test]
fn shadows_fall_away_from_the_light() {
    let view = rendered(&bare(vec![block()]), &down());
    // The mat reflects nothing here, so lend it some: the shadow is what is looked at.
    let mut scene = bare(vec![block()]);
    scene.room.mat_albedo = 0.04;
    let lit = rendered(&scene, &down());
    assert!(at(&view.lights[1], 32, 60) < 1e-12, "a black mat");
    // L2 stands at +y, which is up in the image; L5 at -y.
    let (beyond, before) = (44, 18);
    assert!(at(&lit.lights[1], 32, beyond) < 0.3 * at(&lit.lights[1], 32, before));
    assert!(at(&lit.lights[4], 32, before) < 0.3 * at(&lit.lights[4], 32, beyond));
}

#[test]
fn a_side_that_faces_away_gets_no_direct_light() {
    let view = rendered(
        &bare(vec![block()]),
        &looking([0.43, -0.4, 0.3], [0.43, -0.03, 0.025], 64, 300.0),
    );
    // The side in view faces -y: L2 stands behind it, L5 in front of it.
    let normal = view.normals.get(32, 36).unwrap();
    assert!(normal[1] < -0.99, "{normal:?}");
    assert!(at(&view.lights[1], 32, 36) < 1e-9, "{}", at(&view.lights[1], 32, 36));
    assert!(at(&view.lights[4], 32, 36) > 1e-3);
}

#[test]
fn light_bounces_off_a_wall_into_the_shadow() {
    let wall = Wall {
        centre: Point3::new(0.43, -0.15, 0.05),
        normal: Vector3::y_axis(),
        right: -Vector3::x_axis(),
        size: [0.2, 0.1],
        albedo: 0.8,
    };
    let mut scene = bare(vec![block()]);
    let view = looking([0.43, -0.4, 0.4], [0.43, -0.03, 0.025], 64, 300.0);
    let before = rendered(&scene, &view);
    scene.room.walls.push(wall);
    let after = rendered(&scene, &view);
    let pixel = |view: &RenderedView| at(&view.lights[1], 32, 36);
    assert!(pixel(&before) < 1e-9, "{}", pixel(&before));
    assert!(pixel(&after) > 1e-5, "{}", pixel(&after));
}

#[test]
fn the_same_world_gives_the_same_images_on_one_thread_and_on_many() {
    let scene = rig(vec![block()]);
    let view = down();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rendered(&scene, &view))
    };
    let (one, many) = (on(1), on(3));
    for (a, b) in one
        .lights
        .iter()
        .zip(&many.lights)
        .chain([(&one.ambient, &many.ambient)])
    {
        assert_eq!(a.as_bytes(), b.as_bytes());
    }
}

#[test]
fn a_mirrored_scene_gives_a_mirrored_image() {
    let mut scene = bare(vec![block()]);
    // L1 and L3 stand opposite each other across the plane x = 0.43.
    for panel in &mut scene.panels {
        panel.radiance = 1.0;
    }
    scene.room.mat_albedo = 0.3;
    let view = rendered(&scene, &down());
    let (mut difference, mut sum) = (0.0, 0.0);
    for y in 0..64 {
        for x in 0..64 {
            let (here, there) = (at(&view.lights[0], x, y), at(&view.lights[2], 63 - x, y));
            difference += (here - there).abs();
            sum += here + there;
        }
    }
    assert!(difference < 0.01 * sum, "{}", difference / sum);
}

#[test]
fn truth_is_what_the_lens_shows() {
    let lens = PlumbBob {
        k1: -0.2,
        p1: 0.01,
        ..PlumbBob::default()
    };
    let mut view = down();
    view.camera = view.camera.with_distortion(lens);
    let shown = rendered(&rig(vec![block()]), &view);
    let inverse = view.base_from_camera.inverse();
    // A corner of the block's top: just inside of its projection is the block, just outside is not.
    for (inwards, label) in [(0.003, 1), (-0.003, 0)] {
        let corner = Point3::new(0.46 - inwards, 0.03 - inwards, 0.05);
        let pixel = view.camera.project(&inverse.transform_point(&corner)).unwrap();
        let (x, y) = (pixel.x.round() as usize, pixel.y.round() as usize);
        assert_eq!(shown.labels.get(x, y), Some(&label), "{inwards}");
    }
    assert!((at(&shown.depth, 32, 32) - 0.35).abs() < 1e-6);
    assert_eq!(shown.normals.get(32, 32), Some(&[0.0, 0.0, 1.0]));
}

#[test]
fn where_nothing_is_seen_there_is_ambient_light_and_no_truth() {
    let mut scene = bare(Vec::new());
    scene.ambient_radiance = 0.25;
    let up = looking([0.43, 0.0, 1.2], [0.43, 0.5, 3.0], 16, 100.0);
    let view = rendered(&scene, &up);
    assert!(view.ambient.pixels().iter().all(|&a| (a - 0.25).abs() < 1e-6));
    assert!(view.depth.pixels().iter().all(|d| d.is_nan()));
    assert!(view.normals.pixels().iter().all(|n| n[0].is_nan()));
    assert!(view.lights[0].pixels().iter().all(|&l| l == 0.0));
}

#[test]
fn a_camera_that_looks_into_a_panel_sees_its_radiance() {
    let scene = bare(Vec::new());
    let view = rendered(&scene, &looking([0.43, 0.0, 0.1], [0.43, 1e-6, 0.9], 16, 200.0));
    assert!((at(&view.lights[6], 8, 8) - scene.panels[6].radiance).abs() < 1e-6);
    assert!(at(&view.lights[0], 8, 8).abs() < 1e-12, "panels are black");
}

#[test]
fn a_mesh_with_missing_vertices_is_refused() {
    let mut broken = block();
    broken.mesh.triangles.push([0, 1, 99]);
    let error = render(&rig(vec![broken]), &down(), &RenderOptions::default()).unwrap_err();
    assert!(error.to_string().contains("vertex 99"), "{error}");
}

#[test]
fn a_very_large_or_flat_mesh_takes_no_more_work_than_its_pixels() {
    // A kilometre long splinter and a plate far larger than the cell.
    let splinter = TriangleMesh {
        vertices: vec![
            Point3::new(-500.0, 0.0, 0.01),
            Point3::new(500.0, 0.0, 0.01),
            Point3::new(500.0, 1e-5, 0.01),
        ],
        triangles: vec![[0, 1, 2]],
    };
    let plate = cuboid([-300.0, -300.0, -1.0], [300.0, 300.0, 0.002]);
    let view = rendered(&rig(vec![body(splinter, 0.5), body(plate, 0.5)]), &down());
    assert!(
        view.lights
            .iter()
            .all(|light| light.pixels().iter().all(|l| l.is_finite()))
    );
    assert_eq!(view.labels.get(8, 8), Some(&2));
}

#[test]
fn shadows_of_a_thin_plate_have_a_soft_edge() {
    let mut scene = bare(vec![body(cuboid([0.40, -0.1, 0.04], [0.46, 0.1, 0.041]), 0.0)]);
    scene.room.mat_albedo = 0.5;
    let light = scene.panels[5];
    assert!(light.facing.x < 0.0, "L6 stands at +x");
    let view = rendered(&scene, &looking([0.30, 0.0, 0.4], [0.30, 0.0, 0.0], 96, 200.0));
    let row: Vec<f64> = (0..96).map(|x| at(&view.lights[5], x, 48)).collect();
    let (least, most) = row.iter().fold((f64::MAX, 0.0_f64), |(a, b), &v| (a.min(v), b.max(v)));
    let between = row
        .iter()
        .filter(|&&v| v > least + 0.2 * (most - least) && v < most - 0.2 * (most - least));
    assert!(least < 0.6 * most, "{least} of {most}");
    assert!(between.count() > 8, "the edge is as wide as the panel makes it");
}

#[test]
fn a_print_is_where_the_body_is() {
    let mut printed = block();
    printed.albedo = Albedo::Print {
        seed: 5,
        cell: 0.01,
        range: [0.1, 0.9],
    };
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI);
    let mut turned = printed.clone();
    let base_from_base = RigidTransform::from_parts(Vector3::new(0.86, 0.0, 0.0), turn);
    turned.mesh = printed.mesh.transformed(&base_from_base);
    turned.base_from_body = base_from_base * printed.base_from_body;
    let shown = |body: Body| {
        let mut scene = bare(vec![body]);
        scene.panels[6].size = [0.1, 0.1];
        rendered(&scene, &down())
    };
    let (before, after) = (shown(printed), shown(turned));
    let mut values = std::collections::BTreeSet::new();
    for (x, y) in [(27, 27), (30, 36), (36, 30), (34, 27)] {
        let (here, there) = (at(&before.lights[6], x, y), at(&after.lights[6], 63 - x, 63 - y));
        assert!((here / there - 1.0).abs() < 0.02, "{here} {there}");
        values.insert((here * 1e6) as i64);
    }
    assert!(values.len() > 1, "the print varies");
}

#[test]
fn unit_axes_of_the_rig_are_orthonormal() {
    for panel in Panel::rig() {
        assert!(panel.facing.dot(&panel.right).abs() < 1e-12);
        let corners = panel.corners();
        assert!(((corners[1] - corners[0]).norm() - panel.size[0]).abs() < 1e-12);
        let _: Unit<Vector3<f64>> = panel.facing;
    }
    let (c1, c2) = (View::rig_c1().unwrap(), View::rig_c2().unwrap());
    for view in [c1, c2] {
        let middle = view
            .base_from_camera
            .inverse()
            .transform_point(&Point3::new(0.43, 0.0, 0.0));
        let pixel = view.camera.project(&middle).unwrap();
        assert!((pixel - Point3::new(767.5, 767.5, 0.0).xy()).norm() < 150.0, "{pixel}");
    }
}
