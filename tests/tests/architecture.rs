//! Holds the architecture: the arrows between crates, the top level, and what the README says of both.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package};

/// What a crate is, and so what it may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Layer {
    Algorithm,
    Protocol,
    Devices,
    Driver,
    Recording,
    Files,
    InterfaceGenerator,
    Interfaces,
    Ros,
    Node,
    Simulator,
    Binary,
    Tests,
}

use Layer::{
    Algorithm, Binary, Devices, Driver, Files, InterfaceGenerator, Interfaces, Node, Protocol, Recording, Ros,
    Simulator, Tests,
};

/// Every crate has a layer; one that is missing here fails the test.
fn layer(name: &str) -> Option<Layer> {
    Some(match name {
        "geometry" | "imaging" | "photometric" | "render" | "grasp" | "localization" | "registration"
        | "deformation" | "kinematics" | "trajectory" | "collision" | "camera_calibration" => Algorithm,
        "light_protocol" | "gige_vision" | "xarm_protocol" => Protocol,
        "devices" => Devices,
        "light_serial" | "camera_aravis" | "xarm_tcp" => Driver,
        "recording" => Recording,
        "rig_scenes" | "calibration_files" => Files,
        "interface_generator" => InterfaceGenerator,
        "interfaces" => Interfaces,
        "ros" => Ros,
        "bag_player"
        | "light_sequencer"
        | "camera_capture"
        | "normal_solver"
        | "grasp_planner"
        | "trajectory_executor"
        | "cell_coordinator"
        | "bag_recorder" => Node,
        "sim" => Simulator,
        "rakelight" => Binary,
        "scenarios" => Tests,
        _ => return None,
    })
}

/// The layers that each layer may use.
fn allowed(from: Layer) -> &'static [Layer] {
    match from {
        Protocol | Recording | InterfaceGenerator => &[],
        Algorithm | Devices | Files => &[Algorithm],
        Driver => &[Algorithm, Protocol, Devices],
        Interfaces => &[InterfaceGenerator],
        Ros => &[Algorithm, Interfaces],
        Node => &[Algorithm, Devices, Driver, Recording, Files, Interfaces, Ros],
        Simulator => &[Algorithm, Protocol],
        Binary => &[
            Algorithm, Devices, Driver, Recording, Files, Interfaces, Ros, Node, Simulator,
        ],
        Tests => &[
            Algorithm,
            Protocol,
            Devices,
            Driver,
            Recording,
            Files,
            InterfaceGenerator,
            Interfaces,
            Ros,
            Node,
            Simulator,
            Binary,
        ],
    }
}

/// What algorithms never touch: ROS, clocks, sockets, loggers, runtimes of their own.
const FORBIDDEN_TO_ALGORITHMS: [&str; 8] = [
    "tokio",
    "ros2-client",
    "rustdds",
    "tracing",
    "log",
    "chrono",
    "socket2",
    "mcap",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("tests/ lies in the repository")
        .to_owned()
}

fn metadata() -> Metadata {
    MetadataCommand::new()
        .manifest_path(root().join("Cargo.toml"))
        .no_deps()
        .exec()
        .expect("cargo metadata runs")
}

/// Dependencies that end up in the crate (not those of its tests).
fn dependencies(package: &Package) -> impl Iterator<Item = &str> {
    package
        .dependencies
        .iter()
        .filter(|d| d.kind != DependencyKind::Development)
        .map(|d| d.name.as_str())
}

#[test]
fn crates_use_only_the_layers_below_them() {
    let metadata = metadata();
    let mut wrong = Vec::new();
    for package in &metadata.packages {
        let Some(from) = layer(&package.name) else {
            wrong.push(format!("{} has no layer: give it one in this test", package.name));
            continue;
        };
        for used in dependencies(package) {
            if let Some(to) = layer(used).filter(|to| !allowed(from).contains(to)) {
                wrong.push(format!("{} ({from:?}) must not use {used} ({to:?})", package.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn algorithms_know_no_ros_clock_socket_or_logger() {
    let metadata = metadata();
    let wrong: Vec<String> = metadata
        .packages
        .iter()
        .filter(|p| layer(&p.name) == Some(Algorithm))
        .flat_map(|p| {
            dependencies(p)
                .filter(|d| FORBIDDEN_TO_ALGORITHMS.contains(d))
                .map(|d| format!("{} uses {d}", p.name))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn only_the_ros_crate_knows_the_client_library() {
    let metadata = metadata();
    for library in ["ros2-client", "rustdds"] {
        let users: Vec<&str> = metadata
            .packages
            .iter()
            .filter(|p| p.dependencies.iter().any(|d| d.name == library))
            .map(|p| p.name.as_str())
            .collect();
        assert_eq!(users, ["ros"], "crates that use {library}");
    }
}

#[test]
fn the_top_level_holds_what_the_layout_says() {
    let expected = [
        "Cargo.lock",
        "Cargo.toml",
        "README.md",
        "bags",
        "crates",
        "launch_configs",
        "msgs",
        "tests",
        "urdf",
    ];
    let listed = Command::new("git")
        .args(["ls-files"])
        .current_dir(root())
        .output()
        .expect("git runs");
    if !listed.status.success() {
        println!("SKIPPED: not a git checkout, so what belongs to the project is unknown");
        return;
    }
    let listed = String::from_utf8(listed.stdout).expect("paths are UTF-8");
    let found: BTreeSet<&str> = listed.lines().filter_map(|path| path.split('/').next()).collect();
    let visible: Vec<&str> = found
        .into_iter()
        .filter(|entry| !entry.starts_with('.') && !entry.starts_with("LICENSE"))
        .collect();
    assert_eq!(visible, expected);
}

#[test]
fn the_readme_names_every_crate_that_exists_and_none_that_does_not() {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("README.md is readable");
    let (_, map) = readme
        .split_once("### Code map")
        .expect("README.md has a section `### Code map`");
    let map = map
        .split("\n## ")
        .next()
        .unwrap_or(map)
        .split("\n### ")
        .next()
        .unwrap_or(map);
    let named: BTreeSet<String> = map
        .split("**`")
        .skip(1)
        .filter_map(|rest| rest.split("`**").next())
        .map(str::to_owned)
        .collect();
    let mut existing: BTreeMap<String, PathBuf> = metadata()
        .packages
        .into_iter()
        .map(|p| (p.name.to_string(), p.manifest_path.into_std_path_buf()))
        .collect();
    // Its own workspace, so not among the packages.
    existing.insert("xtask".into(), root().join("crates/xtask/Cargo.toml"));
    let existing: BTreeSet<String> = existing.into_keys().collect();
    assert_eq!(
        named, existing,
        "left: named in the README's code map; right: crates that exist"
    );
}
