//! A recorded capture through ROS, solved, and its normal map as a picture.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::anyhow;
use recording::Bag;
use ros::{DiscoveryRange, NodeOptions};

use super::football::{self, Football};
use super::viewer::{self, Viewer};
use crate::failure::Failure;
use crate::nodes::Running;

const NAMESPACE: &str = "/cell";

/// The player starts once the solver is matched; the viewer gives up when no map has come after this long.
const PATIENCE: Duration = Duration::from_mins(1);

/// What is played, how it is solved, and what of it is shown.
struct Scene {
    name: String,
    bag: PathBuf,
    solver: NodeOptions,
    mask: Option<imaging::Mask>,
}

/// A bag.
pub(super) async fn bag(bag: PathBuf, output: &Path) -> Result<(), Failure> {
    play(recorded(bag)?, output).await
}

/// The photographs of a football in a folder.
pub(super) async fn football(folder: &Path, output: &Path) -> Result<(), Failure> {
    play(photographed(folder, output)?, output).await
}

async fn play(scene: Scene, output: &Path) -> Result<(), Failure> {
    let cameras = cameras(&scene.bag)?;
    println!("{}: playing {} through ROS", scene.name, scene.bag.display());

    let mut running = Running::default();
    running
        .start(normal_solver::NAME, scene.solver.parameter("cameras", cameras.clone()))
        .await?;
    let mut viewer = Viewer::start(options("demo_viewer"), &cameras).await?;
    let player = options(bag_player::NAME)
        .parameter("bag", scene.bag.display().to_string())
        .parameter("wait_for_subscriptions", PATIENCE.as_secs_f64());
    let started = Instant::now();
    running.start(bag_player::NAME, player).await?;
    for _ in &cameras {
        let map = tokio::time::timeout(PATIENCE, viewer.next())
            .await
            .map_err(|_| anyhow!("no normal map came within {PATIENCE:?}; the log above says why"))??;
        let path = output.join(format!("{}_{}_normals.png", scene.name, map.camera));
        let measured = viewer::write_picture(&map, scene.mask.as_ref(), &path)?;
        println!(
            "{}: {} x {} normals, {:.1} % of the {} measured, {:.2} s after the start",
            map.camera,
            map.image.width,
            map.image.height,
            100.0 * measured,
            if scene.mask.is_some() { "object" } else { "image" },
            started.elapsed().as_secs_f64()
        );
        println!("  picture: {}", path.canonicalize().unwrap_or(path).display());
    }
    viewer.stop().await;
    running.stop().await;
    println!("red = facing +x, green = facing +y, blue = facing up; black = not measured");
    Ok(())
}

/// On this machine only, unless the environment says otherwise.
fn options(name: &str) -> NodeOptions {
    let options = NodeOptions::new(name).namespace(NAMESPACE);
    if std::env::var_os("ROS_AUTOMATIC_DISCOVERY_RANGE").is_some() {
        return options;
    }
    options.discovery_range(DiscoveryRange::Localhost)
}

fn recorded(bag: PathBuf) -> Result<Scene, Failure> {
    if !bag.exists() {
        return Err(Failure::usage(anyhow!(
            "no bag at {}; start in the repository or name one with --bag",
            bag.display()
        )));
    }
    let name = bag
        .file_stem()
        .map_or_else(|| "capture".into(), |stem| stem.to_string_lossy().into_owned());
    Ok(Scene {
        name,
        bag,
        solver: options(normal_solver::NAME),
        mask: None,
    })
}

fn photographed(folder: &Path, output: &Path) -> Result<Scene, Failure> {
    let football = Football::read(folder).map_err(Failure::usage)?;
    println!("football: six photographs from {}", folder.display());
    let bag = output.join("football_bag");
    football.write_bag(&bag)?;
    let solver = options(normal_solver::NAME)
        .parameter("lights.frame_id", football::CAMERA_FRAME.to_owned())
        .parameter("lights.directions", football.light_directions_in_camera.concat())
        .parameter("lights.intensities", football.light_intensities())
        .parameter("saturation", i64::from(u16::MAX));
    Ok(Scene {
        name: "football".into(),
        bag,
        solver,
        mask: Some(football.mask),
    })
}

/// Cameras with images in the bag: the last part of a topic's namespace.
fn cameras(bag: &Path) -> anyhow::Result<Vec<String>> {
    let bag = Bag::open(bag)?;
    let prefix = format!("{NAMESPACE}/");
    let camera = |topic: &str| Some(topic.strip_prefix(&prefix)?.strip_suffix("/image_raw")?.to_owned());
    let mut cameras: Vec<String> = bag.topics().iter().filter_map(|topic| camera(&topic.name)).collect();
    cameras.sort();
    if cameras.is_empty() {
        let topics: Vec<&str> = bag.topics().iter().map(|topic| topic.name.as_str()).collect();
        anyhow::bail!(
            "no images below {NAMESPACE} in the bag; its topics: {}",
            topics.join(", ")
        );
    }
    Ok(cameras)
}
