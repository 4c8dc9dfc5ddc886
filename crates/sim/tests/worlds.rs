//! World files: what they leave out is the rig, what is wrong is named with its place.

use std::net::Ipv4Addr;
use std::path::Path;

use geometry::nalgebra::Point3;
use sim::SimError;
use sim::scene::{Albedo, Panel, Room, View};
use sim::world::{Bin, Collisions, Mount, World};

fn world(yaml: &str) -> World {
    World::from_yaml(yaml, Path::new("")).unwrap()
}

fn refusal(yaml: &str) -> String {
    World::from_yaml(yaml, Path::new("")).unwrap_err().to_string()
}

#[test]
fn every_world_file_of_the_repository_shows_its_objects_to_both_cameras() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../launch_configs/worlds");
    let mut names = Vec::new();
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let world = World::read(&path).unwrap();
        assert!(!world.scene.bodies.is_empty(), "{} is empty", path.display());
        for camera in &world.cameras {
            let camera_from_base = world.base_from_camera(camera).inverse();
            for body in &world.scene.bodies {
                let centre = Point3::from(body.base_from_body.translation());
                let pixel = camera.lens.project(&camera_from_base.transform_point(&centre)).unwrap();
                let inside = |value: f64| (100.0..1436.0).contains(&value);
                assert!(
                    inside(pixel.x) && inside(pixel.y),
                    "{}: {} is at {pixel} of {}",
                    path.display(),
                    body.name,
                    camera.name
                );
            }
        }
        names.push(path.file_stem().unwrap().to_string_lossy().into_owned());
    }
    names.sort();
    for needed in ["clutter", "disc", "pick", "table"] {
        assert!(
            names.iter().any(|name| name == needed),
            "{needed} is not among {names:?}"
        );
    }
}

#[test]
fn an_empty_file_is_the_rig_without_objects() {
    let world = world("# nothing\n");
    assert_eq!(world.scene.room, Room::rig());
    assert_eq!(world.scene.panels, Panel::rig());
    assert_eq!(world.lights.wiring, [1, 2, 3, 4, 5, 6, 7].map(Some));
    assert_eq!((world.scene.bodies.len(), world.cameras.len()), (0, 2));
    let [c1, c2] = &world.cameras[..] else {
        panic!("two cameras")
    };
    assert_eq!(
        (c1.name.as_str(), c1.address, c1.trigger_line),
        ("c1", Ipv4Addr::new(127, 0, 0, 2), 1)
    );
    assert_eq!(
        (c2.name.as_str(), c2.address, c2.trigger_line),
        ("c2", Ipv4Addr::new(127, 0, 0, 3), 2)
    );
    assert!(matches!(c1.mount, Mount::Flange { .. }) && matches!(c2.mount, Mount::Table { .. }));
    for (camera, rig) in [(c1, View::rig_c1().unwrap()), (c2, View::rig_c2().unwrap())] {
        let view = world.view(camera, [1, 1]).unwrap();
        assert_eq!(view.camera, rig.camera);
        let apart = (view.base_from_camera.inverse() * rig.base_from_camera)
            .translation()
            .norm();
        assert!(apart < 1e-12, "{} is {apart} m off", camera.name);
    }
}

#[test]
fn the_flange_carries_the_wrist_camera_alone() {
    let moved = world("flange: {x: 0.5, y: 0.1, z: 0.4, roll: 3.14159265}");
    let place = |camera| moved.base_from_camera(moved.camera(camera).unwrap()).translation();
    // The flange looks down, so its x is the base's.
    assert!((place("c1") - geometry::nalgebra::Vector3::new(0.57, 0.1, 0.38)).norm() < 1e-6);
    assert_eq!(place("c2"), View::rig_c2().unwrap().base_from_camera.translation());
}

#[test]
fn a_smaller_sensor_or_binning_keeps_the_field_of_view() {
    let small = world("cameras: {c1: {width: 96, height: 96}}");
    let camera = small.camera("c1").unwrap();
    let whole = world("");
    let rays = |view: &View, share: f64| {
        let [w, h] = [view.camera.width() as f64, view.camera.height() as f64];
        let pixel = geometry::nalgebra::Point2::new(w * share - 0.5, h * share - 0.5);
        view.camera.unproject(&pixel).unwrap()
    };
    let rig = whole.view(whole.camera("c1").unwrap(), [1, 1]).unwrap();
    for view in [small.view(camera, [1, 1]), small.view(camera, [4, 2])].map(Result::unwrap) {
        for share in [0.0, 0.3, 1.0] {
            assert!((rays(&view, share) - rays(&rig, share)).norm() < 1e-9, "{view:?}");
        }
    }
    let binned = small.view(camera, [4, 2]).unwrap();
    assert_eq!((binned.camera.width(), binned.camera.height()), (24, 48));
}

#[test]
fn objects_lights_and_room_are_as_written() {
    let world = world(
        "
        lights:
          swapped: [[1, 2]]
          dead: [3]
          panels:
            L7: {radiance: 2, size: [0.3, 0.2], pose: {z: 1.0, roll: 3.141592653589793}}
        room: {mat_albedo: 0.1, walls: [{pose: {y: 1, roll: 1.5707963267948966}, size: [2, 1], albedo: 1}]}
        ambient: 0
        objects:
          - {shape: box, pose: {z: 0.1}, albedo: {print: 5}}
          - {name: ball, shape: {kind: sphere, radius: 0.02}, pose: {x: 0.4, quaternion: [0, 0, 1, 0]}, albedo: 1}
        ",
    );
    assert_eq!(
        world.lights.wiring,
        [Some(2), Some(1), None, Some(4), Some(5), Some(6), Some(7)]
    );
    let panel = world.scene.panels[6];
    assert!((panel.centre - Point3::new(0.43, 0.0, 1.0)).norm() < 1e-12);
    assert!(panel.facing.z < -0.999_999 && (panel.radiance - 2.0).abs() < 1e-12);
    assert!(panel.size[0] > 0.299 && panel.size[1] < 0.201, "{panel:?}");
    let [wall] = &world.scene.room.walls[..] else {
        panic!("one wall")
    };
    assert!(wall.normal.y < -0.999_999, "{wall:?}");
    assert!((world.scene.room.mat_albedo - 0.1).abs() < 1e-12);
    let [cuboid, ball] = &world.scene.bodies[..] else {
        panic!("two bodies")
    };
    assert_eq!((cuboid.name.as_str(), ball.name.as_str()), ("object 1", "ball"));
    assert!(matches!(cuboid.albedo, Albedo::Print { seed: 5, .. }));
    assert_eq!(ball.albedo, Albedo::Uniform(1.0));
    let lowest = cuboid
        .mesh
        .vertices
        .iter()
        .map(|vertex| vertex.z)
        .fold(f64::INFINITY, f64::min);
    assert!((lowest - 0.1).abs() < 1e-12, "the mesh is in the base frame");
}

#[test]
fn what_is_wrong_is_named_with_place_and_what_is_allowed() {
    for (yaml, expected) in [
        ("colour: red", "unknown field `colour`, expected one of `seed`"),
        (
            "cameras:\n  c1:\n    adress: 127.0.0.9",
            "cameras.c1: unknown field `adress`",
        ),
        ("cameras:\n  c1:\n    adress: 127.0.0.9", "at line 3 column 5"),
        (
            "cameras: {c1: {address: 127.0.0.300}}",
            "cameras.c1.address: invalid IPv4",
        ),
        (
            "objects: [{shape: teapot}]",
            "objects[0].shape: unknown variant `teapot`",
        ),
        (
            "objects: [{shape: {kind: box, side: 1}}]",
            "objects[0].shape: unknown field `side`",
        ),
        ("objects: [{pose: {}}]", "objects[0]: missing field `shape`"),
        (
            "objects: [{shape: box, albedo: bright}]",
            "objects[0].albedo: invalid type: string \"bright\"",
        ),
        (
            "objects: [{shape: box}, {shape: {kind: sphere, radius: -1}}]",
            "objects[1].shape.radius is -1 m; allowed is 0.0001 to 1 m",
        ),
        (
            "objects: [{shape: box, albedo: 1.5}]",
            "objects[0].albedo.value is 1.5; allowed is 0 to 1",
        ),
        (
            "objects: [{shape: box, albedo: {print: 1, range: [0.5, 0.2]}}]",
            "objects[0].albedo.range[1] is 0.2; allowed is 0.5 to 1",
        ),
        (
            "objects: [{shape: box, name: a}, {shape: disc, name: a}]",
            "objects[1].name is a; allowed is a name that no other object has",
        ),
        (
            "objects: [{shape: box, pose: {yaw: 1, quaternion: [0, 0, 0, 1]}}]",
            "objects[0].pose.quaternion is given beside roll, pitch or yaw; allowed is one of both",
        ),
        ("flange: {x: .nan}", "must be finite"),
        ("lights: {dead: [8]}", "lights.dead[0] is 8; allowed is 1 to 7"),
        (
            "lights: {swapped: [[1, 0]]}",
            "lights.swapped[0] is 0; allowed is 1 to 7",
        ),
        ("lights: {panels: {L8: {}}}", "lights.panels: unknown field `L8`"),
        (
            "lights: {panels: {L2: {radiance: -1}}}",
            "lights.panels.L2.radiance is -1; allowed is 0 to 1000",
        ),
        (
            "cameras: {c2: {trigger_line: 3}}",
            "cameras.c2.trigger_line is 3; allowed is 1 to 2",
        ),
        (
            "cameras: {c2: {address: 127.0.0.2}}",
            "cameras.c2.address is 127.0.0.2; allowed is another",
        ),
        (
            "cameras: {c2: {serial: RAKELIGHT-C1}}",
            "cameras.c2.serial is RAKELIGHT-C1; allowed is another",
        ),
        ("cameras: {c1: {width: 10}}", "camera c1: a sensor of 10 x 1536 pixels"),
        (
            "cameras: {c1: {binning: 3}}",
            "cameras.c1.binning is 3; allowed is 1, 2 or 4",
        ),
        (
            "cameras: {c1: {base_from_camera: {}, flange_from_camera: {}}}",
            "cameras.c1.flange_from_camera is given beside base_from_camera; allowed is one of both",
        ),
        (
            "cameras: {c1: {full_well: 0}}",
            "cameras.c1.full_well is 0; allowed is 100 to 10000000",
        ),
        ("room: {table_albedo: 2}", "room.table_albedo is 2; allowed is 0 to 1"),
        (
            "room: {walls: [{pose: {}, size: [0, 1], albedo: 1}]}",
            "room.walls[0].size is 0; allowed is 0.001 to 100",
        ),
        ("ambient: -1", "ambient is -1; allowed is 0 to 1000"),
    ] {
        let error = refusal(yaml);
        assert!(
            error.contains(expected),
            "{yaml}\ngave     {error}\nexpected {expected}"
        );
    }
}

#[test]
fn files_are_named_and_meshes_and_ports_lie_beside_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.yaml");
    let missing = World::read(&path).unwrap_err();
    assert!(matches!(&missing, SimError::ReadFile { path: named, .. } if *named == path));
    std::fs::write(&path, "ambient: 1e9").unwrap();
    let error = World::read(&path).unwrap_err().to_string();
    assert!(error.contains("world.yaml: ambient is 1000000000"), "{error}");
    std::fs::write(folder.path().join("part.obj"), "v 0 0 0\nv 10 0 0\nv 0 9 0\nf 1 2 3\n").unwrap();
    std::fs::write(
        &path,
        "{objects: [{shape: {kind: mesh, file: part.obj, scale: 0.001}}], lights: {port: tty}}",
    )
    .unwrap();
    let world = World::read(&path).unwrap();
    assert_eq!(world.scene.bodies[0].mesh.triangles.len(), 1);
    assert_eq!(world.lights.port, Some(folder.path().join("tty")));
}

#[test]
fn an_arm_holds_its_flange_where_the_world_says() {
    assert_eq!(world("").arm, None);
    let rig = world("");
    let with_arm = world("arm: {vacuum: 2, firmware: v1.12.10}");
    let apart = rig.base_from_flange.inverse() * with_arm.base_from_flange;
    assert!(apart.translation().norm() < 1e-6 && apart.rotation().angle() < 1e-6);
    let arm = with_arm.arm.expect("an arm");
    assert_eq!((arm.address, arm.ports.control), (Ipv4Addr::new(127, 0, 0, 4), 5020));
    assert_eq!(
        [arm.ports.normal, arm.ports.rich, arm.ports.real],
        [30001, 30002, 30003]
    );
    let placed = world("arm: {joints: [0, -0.4, 0, 0.7, 0, 1.1, 0], report_ports: [1, 2, 3]}");
    assert!((placed.base_from_flange.translation().x - 0.350_648).abs() < 1e-6);
    assert_eq!(placed.arm.expect("an arm").ports.real, 3);
}

#[test]
fn impossible_arms_are_refused() {
    let cases = [
        ("arm: {vacuum: 3}", "arm.vacuum is 3; allowed is 1 or 2"),
        (
            "arm: {firmware: v9.0.0}",
            "arm.firmware is v9.0.0 (firmware v9.0.0 is not known",
        ),
        (
            "arm: {joints: [0, 3, 0, 0, 0, 0, 0]}",
            "arm.joints is [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0] (angle of joint `joint2`",
        ),
        (
            "{arm: {}, flange: {x: 3}}",
            "arm.joints is not given, and no joint angles",
        ),
        ("arm: {port: 502}", "unknown field `port`"),
    ];
    for (yaml, expected) in cases {
        let found = refusal(yaml);
        assert!(found.contains(expected), "{yaml}: {found}");
    }
}

#[test]
fn the_bin_is_that_of_the_cell_unless_the_file_says_otherwise() {
    let urdf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../urdf/cell.urdf");
    let urdf = std::fs::read_to_string(urdf).unwrap();
    let joint = urdf.split("link_base_to_bin").nth(1).expect("the cell has a bin");
    assert!(joint.contains("xyz=\"0.180000 0.360000 0\""), "{joint}");
    let bin = world("").bin;
    let drawn = Bin {
        x: 0.18,
        y: 0.36,
        yaw: 0.0,
        size: 0.18,
        height: 0.06,
    };
    assert_eq!(bin, drawn);
    let moved = world("bin: {x: 0.1, yaw: 0.7853981633974483, size: 0.1}").bin;
    assert!((moved.y - 0.36).abs() < 1e-12, "what is not said stays");
    assert!(moved.holds(&Point3::new(0.1 + 0.07, 0.36, 0.2)), "a corner");
    assert!(!moved.holds(&Point3::new(0.1 + 0.04, 0.36 + 0.04, 0.2)));
    assert_eq!(refusal("bin: {size: 0}"), "bin.size is 0; allowed is 0.01 to 10");
    assert_eq!(refusal("bin: {height: 20}"), "bin.height is 20; allowed is 0.004 to 10");
}

#[test]
fn an_arm_stops_at_collisions_unless_it_is_to_count_them() {
    let collisions = |yaml: &str| world(yaml).arm.expect("an arm").collisions;
    assert_eq!(collisions("arm: {}"), Collisions::Stop);
    assert_eq!(collisions("arm: {collisions: count}"), Collisions::Count);
    assert!(refusal("arm: {collisions: maybe}").contains("maybe"));
}
