//! `rakelight capture`: one light sequence on a running cell.

mod pictures;
mod receiver;
mod report;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, ensure};
use clap::Args;
use interfaces::rakelight_msgs::srv::{Capture, CaptureRequest, CaptureResponse};
use interfaces::rcl_interfaces::srv::{GetParameters, GetParametersRequest};
use ros::{Node, ServiceClient};

use crate::ending::Signals;
use crate::failure::Failure;
use crate::place::{self, Place};
use receiver::Receiver;
use report::{Report, summary};

/// Discovery takes up to 1.2 s; on a busy machine, longer.
const DISCOVERY: Duration = Duration::from_secs(6);

/// A void capture is repeated once, and others may be waiting for their turn.
const CAPTURE: Duration = Duration::from_secs(30);

/// For all images of all cameras to arrive.
const IMAGES: Duration = Duration::from_secs(20);

#[derive(Args)]
pub(crate) struct Arguments {
    /// Cameras, separated by commas [default: all of the cell].
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    cameras: Vec<String>,
    /// How many captures to take, one after the other.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    count: u32,
    /// Write every image (16 bits) and a sheet of each camera's images (8 bits) into this folder.
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
    /// Tell of each capture as one JSON object a line.
    #[arg(long)]
    json: bool,
    /// Namespace of the cell.
    #[arg(long, default_value = "/cell")]
    namespace: String,
    /// Launch config of the cell, for a cell in a domain of its own [default: the environment, or the cell that runs here].
    #[arg(long)]
    config: Option<PathBuf>,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    // A name that no other command has at the same time.
    let name = format!("capture_{}", std::process::id());
    let options = place::options(&name, &arguments.namespace, arguments.config.as_deref()).map_err(Failure::usage)?;
    let mut signals = Signals::listen()?;
    let place = Place::of(&options)?;
    let node = Node::start(options).await.map_err(Failure::usage)?;
    let outcome = tokio::select! {
        outcome = captures(&node, &place, &arguments) => outcome,
        () = signals.next() => Err(anyhow!("interrupted")),
    };
    node.shutdown().await;
    Ok(outcome?)
}

async fn captures(node: &Node, place: &Place, arguments: &Arguments) -> anyhow::Result<()> {
    let all = cameras_of_cell(node).await.map_err(|_| place.no_cell(node))?;
    let cameras = if arguments.cameras.is_empty() {
        &all
    } else {
        &arguments.cameras
    };
    if let Some(unknown) = cameras.iter().find(|camera| !all.contains(camera)) {
        return Err(anyhow!("the cell has no camera {unknown:?}; it has {}", all.join(", ")));
    }
    let mut receiver = Receiver::new(node, cameras)?;
    // Readers are made known in order: an answer to a reader made after those of the images says that the cameras' node
    // knows them too, so that no image is lost.
    cameras_of_cell(node).await.map_err(|_| place.no_cell(node))?;
    let client = node.service_client::<Capture>("capture")?;
    let mut reports = Vec::new();
    for _ in 0..arguments.count {
        let report = one(&client, &mut receiver, &cameras.clone(), arguments).await?;
        println!(
            "{}",
            if arguments.json {
                report.to_json()?
            } else {
                report.for_people()
            }
        );
        reports.push(report);
    }
    if reports.len() > 1 && !arguments.json {
        println!("{}", summary(&reports));
    }
    Ok(())
}

/// The names of the cameras, as their node's parameter says.
async fn cameras_of_cell(node: &Node) -> anyhow::Result<Vec<String>> {
    let service = format!("{}/get_parameters", camera_capture::NAME);
    let client = node.service_client::<GetParameters>(&service)?;
    let request = GetParametersRequest {
        names: vec!["cameras".into()],
    };
    let answer = client.call(request, DISCOVERY).await?;
    let value = answer.values.first().context("the cell does not tell its cameras")?;
    Ok(value.string_array_value.clone())
}

async fn one(
    client: &ServiceClient<Capture>,
    receiver: &mut Receiver,
    cameras: &[String],
    arguments: &Arguments,
) -> anyhow::Result<Report> {
    let request = CaptureRequest {
        cameras: cameras.to_vec(),
    };
    let asked = Instant::now();
    let response = client.call(request, CAPTURE).await?;
    let answered = asked.elapsed();
    let CaptureResponse {
        capture_id,
        count,
        message,
        ..
    } = &*response;
    ensure!(response.success, "no capture: {message}");
    let frames = receiver.frames(capture_id, usize::from(*count), IMAGES).await?;
    let received = asked.elapsed();
    let sheets = match arguments.png.clone() {
        None => Vec::new(),
        Some(folder) => {
            let (id, frames) = (capture_id.clone(), frames.clone());
            tokio::task::spawn_blocking(move || pictures::write(&folder, &id, &frames)).await??
        }
    };
    Ok(Report::new(&response, &frames, answered, received, sheets))
}
