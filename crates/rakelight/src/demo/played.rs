//! `rakelight demo`: a recorded capture through ROS, solved, and its normal map as a picture.

pub(crate) mod football;
mod viewer;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use clap::Args;
use recording::Bag;
use ros::{DiscoveryRange, NodeOptions};

use crate::failure::Failure;
use crate::nodes::Running;
use football::Football;
use viewer::Viewer;

const NAMESPACE: &str = "/cell";

/// The player starts once the solver is matched; the viewer gives up when no map has come after this long.
const PATIENCE: Duration = Duration::from_mins(1);

#[derive(Args)]
pub(crate) struct Arguments {
    /// Bag to play.
    #[arg(long, default_value = "bags/octagon2")]
    bag: PathBuf,
    /// Solve the photographs of a football in this folder instead.
    #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "../shared/data/white_football")]
    football: Option<PathBuf>,
    /// Where pictures go.
    #[arg(long, default_value = "demo_output")]
    output: PathBuf,
}

/// What is played, how it is solved, and what of it is shown.
struct Scene {
    name: String,
    bag: PathBuf,
    solver: NodeOptions,
    mask: Option<imaging::Mask>,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.output)
        .with_context(|| format!("cannot create {}", arguments.output.display()))?;
    let scene = match &arguments.football {
        None => recorded(arguments.bag)?,
        Some(folder) => photographed(folder, &arguments.output)?,
    };
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
        let path = arguments
            .output
            .join(format!("{}_{}_normals.png", scene.name, map.camera));
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

fn photographed(folder: &std::path::Path, output: &std::path::Path) -> Result<Scene, Failure> {
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
fn cameras(bag: &std::path::Path) -> anyhow::Result<Vec<String>> {
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
