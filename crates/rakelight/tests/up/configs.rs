//! The launch configs of the repository, and what bad ones are told.

use std::path::{Path, PathBuf};

use camera_aravis::CalibrationFile;
use geometry::RigidTransform;
use ros::{LaunchConfig, ParameterValue};
use scenarios::Domain;
use sim::world::World;

use super::{Config, rakelight, repository};

fn launch_configs() -> Vec<PathBuf> {
    let folder = repository().join("launch_configs");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "yaml"))
        .collect();
    paths.sort();
    assert!(paths.len() >= 4, "{paths:?}");
    paths
}

/// The nodes of a config start with it, which they do only if they declare every parameter that it sets.
fn nodes_start(path: &Path) {
    let domain = Domain::claim();
    let config = LaunchConfig::read(path).unwrap();
    let bag = format!("bag_player:bag:={}", repository().join("bags/octagon2").display());
    let mut arguments = vec!["node"];
    arguments.extend(config.nodes());
    arguments.extend(["--config", path.to_str().unwrap(), "--end-with-stdin", "--ros-args"]);
    // Nothing that is there is to be touched.
    for elsewhere in [
        bag.as_str(),
        "light_sequencer:port:=/nowhere/lights",
        "camera_capture:c1.guid:=127.77.1.1",
        "camera_capture:c2.guid:=127.77.1.2",
        "trajectory_executor:host:=127.77.1.3",
    ] {
        if config.nodes().any(|node| elsewhere.starts_with(&format!("{node}:"))) {
            arguments.extend(["-p", elsewhere]);
        }
    }
    let mut nodes = rakelight(&domain, &arguments);
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(async {
        let observer = domain.node("observer").await;
        for node in config.nodes() {
            let name = format!("/cell/{node}");
            observer.wait_for_node(&name, scenarios::TIMEOUT).await.unwrap();
        }
        observer.shutdown().await;
    });
    assert_eq!(nodes.finish().code(), Some(0), "{}: {}", path.display(), nodes.stderr());
}

#[test]
fn the_nodes_of_every_config_declare_what_it_sets() {
    for path in launch_configs() {
        nodes_start(&path);
    }
}

fn text(value: Option<&ParameterValue>) -> &str {
    match value {
        Some(ParameterValue::String(text)) => text,
        other => panic!("no text: {other:?}"),
    }
}

fn pose(value: Option<&ParameterValue>) -> RigidTransform {
    let Some(ParameterValue::Floats(numbers)) = value else {
        panic!("no pose: {value:?}")
    };
    let [x, y, z, qx, qy, qz, qw] = numbers[..] else {
        panic!("no pose: {numbers:?}")
    };
    RigidTransform::from_quaternion_xyzw([x, y, z], [qx, qy, qz, qw]).unwrap()
}

/// What the nodes are told of the cameras is what the simulated ones are.
fn agrees_with_its_world(config: &LaunchConfig, world: &World) {
    let parameters = config.parameters(camera_capture::NAME);
    let port = config.parameters(light_sequencer::NAME);
    assert_eq!(Some(Path::new(text(port.get("port")))), world.lights.port.as_deref());
    for camera in &world.cameras {
        let of = |name: &str| parameters.get(&format!("{}.{name}", camera.name));
        assert_eq!(text(of("guid")), camera.address.to_string());
        let error = pose(of("pose")).inverse() * world.base_from_camera(camera);
        assert!(error.translation().norm() < 1e-5, "{}: {error:?}", camera.name);
        assert!(error.rotation().angle() < 1e-5, "{}: {error:?}", camera.name);
        let calibration = CalibrationFile::read(text(of("camera_info_url"))).unwrap();
        assert_eq!(calibration.camera(), &camera.lens, "{}", camera.name);
    }
}

#[test]
fn simulated_configs_agree_with_their_world() {
    let configs: Vec<LaunchConfig> = launch_configs()
        .iter()
        .map(|path| LaunchConfig::read(path).unwrap())
        .collect();
    let simulated: Vec<&LaunchConfig> = configs
        .iter()
        .filter(|config| config.cell.simulator.is_some())
        .collect();
    assert!(simulated.len() >= 2);
    for config in simulated {
        let world = World::read(config.cell.simulator.as_ref().unwrap()).unwrap();
        agrees_with_its_world(config, &world);
    }
}

#[test]
fn bad_configs_are_refused_with_their_place() {
    let domain = Domain::claim();
    for (text, named) in [
        (
            "cell:\n  processes:\n    vision: [no_such_node]\n",
            "cell.yaml:2: no node \"no_such_node\"; allowed: bag_player",
        ),
        (
            "cell:\n  simulator: no_such_world.yaml\n  processes:\n    vision: [normal_solver]\n",
            "no world file at ",
        ),
        (
            "cell:\n  processes:\n    vision: [normal_solver]\nnormal_solver:\n  ros__parameters:\n    saturatoin: 5\n",
            "cell.yaml:6",
        ),
        ("cell:\n  processes: {}\n  simulate: x\n", "cell.yaml:3"),
    ] {
        let config = Config::new(text);
        let mut up = rakelight(&domain, &["up", "--config", config.as_str()]);
        let code = up.wait().code();
        assert!(
            up.stderr().lines().last().unwrap_or("").contains(named),
            "{named}: {}",
            up.stderr()
        );
        assert_eq!(code, Some(2), "{named}");
    }
}

#[test]
fn ros_arguments_and_absent_files_are_bad_usage() {
    let domain = Domain::claim();
    for (arguments, named) in [
        (&["up", "--ros-args", "-p", "x:=1"][..], "launch config"),
        (&["up", "--config", "no_such.yaml"][..], "no_such.yaml"),
        (&["capture", "--config", "no_such.yaml"][..], "no_such.yaml"),
        (&["capture", "--count", "0"][..], "1..=10000"),
    ] {
        let mut program = rakelight(&domain, arguments);
        let code = program.wait().code();
        assert_eq!(code, Some(2), "{arguments:?}: {}", program.stderr());
        assert!(program.stderr().contains(named), "{arguments:?}: {}", program.stderr());
    }
}

#[test]
fn without_a_cell_capture_says_what_to_do() {
    let domain = Domain::claim();
    let mut capture = rakelight(&domain, &["capture"]);
    assert_eq!(capture.wait().code(), Some(1));
    let said = capture.stderr();
    let place = format!("no cell answers in namespace /cell of ROS domain {}", domain.number());
    assert!(said.contains(&place) && said.contains("`rakelight up`"), "{said}");
}
