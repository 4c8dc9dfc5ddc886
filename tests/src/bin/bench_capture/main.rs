//! Measures captures of the simulated cell at the sensors' full size: how long one takes from the service call to its
//! answer, how exactly the panels are timed, what recording costs, and how long the simulator needs to render.
//!
//! The simulated cell runs in this process, the nodes in processes of their own, as `rakelight up` starts them. Socket
//! buffers are the kernel's default. The run over plain UDP has the capability for packet sockets taken away.

mod measure;
mod nodes;
mod pins;
mod rendering;
mod report;

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use scenarios::{Domain, Place};
use tracing::level_filters::LevelFilter;

use measure::Operator;
use nodes::Transport;
use pins::Pins;
use report::{Recording, Report};

#[derive(Parser)]
#[command(about = "Measures captures of the simulated cell; see the README for the figures to expect")]
struct Arguments {
    /// Print one JSON object as the last thing on standard output.
    #[arg(long)]
    json: bool,
    /// Captures over each transport.
    #[arg(long, default_value_t = 100)]
    count: usize,
    /// Captures with and without a recording each.
    #[arg(long, default_value_t = 20)]
    recorded: usize,
    /// Seconds between two captures of the recording's comparison: what an arm needs at the least between two picks.
    #[arg(long, default_value_t = 2.0)]
    pause: f64,
}

#[tokio::main]
async fn main() -> anyhow::Result<ExitCode> {
    let arguments = Arguments::parse();
    ros::logging::init(LevelFilter::WARN)?;
    let report = everything(&arguments).await?;
    println!("{report}");
    if arguments.json {
        println!("{}", serde_json::to_string(&report)?);
    }
    Ok(if report.complete() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

async fn everything(arguments: &Arguments) -> anyhow::Result<Report> {
    let folder = tempfile::tempdir()?;
    let place = Place::new(folder.path());
    let world = nodes::world(&place)?;
    eprintln!("rendering both views ...");
    let rendering = rendering::measure(&world)?;
    let pins = Pins::default();
    let cell = nodes::simulated_cell(world, &pins)?;
    eprintln!("{} captures over UDP ...", arguments.count);
    let udp = captures(arguments, Transport::Udp, &place).await?;
    eprintln!("{} captures over packet sockets ...", arguments.count);
    let packet_socket = captures(arguments, Transport::PacketSocket, &place).await?;
    eprintln!("{} captures with and without a recording ...", 2 * arguments.recorded);
    let recording = recording(arguments, &place, folder.path()).await?;
    let report = Report::new(udp, packet_socket, &pins.on_times(), recording, rendering);
    drop(cell);
    Ok(report)
}

async fn captures(arguments: &Arguments, transport: Transport, place: &Place) -> anyhow::Result<measure::Captures> {
    let domain = Domain::claim();
    let nodes = nodes::start(&domain, place, transport)?;
    let operator = Operator::start(&domain).await?;
    let captures = operator.captures(arguments.count, Duration::ZERO).await?;
    operator.stop().await;
    nodes.stop().await?;
    Ok(captures)
}

async fn recording(arguments: &Arguments, place: &Place, folder: &std::path::Path) -> anyhow::Result<Recording> {
    let domain = Domain::claim();
    let nodes = nodes::start(&domain, place, Transport::Udp)?;
    let operator = Operator::start(&domain).await?;
    let recording = operator
        .compare_recording(arguments.recorded, Duration::from_secs_f64(arguments.pause), folder)
        .await?;
    operator.stop().await;
    nodes.stop().await?;
    Ok(recording)
}
