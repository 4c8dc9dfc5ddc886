//! Measures pick cycles of the simulated cell: how many objects get into the bin, how exact the grasps are, what
//! each stage takes, and why what was missed was missed.
//!
//! The simulated cell runs in this process, which so knows the truth; the nodes run in processes of their own, as
//! `rakelight up` starts them, and are asked by the action `pick_cycle` alone. Worlds are scattered by seed.

mod cell;
mod perception;
mod picks;
mod report;
mod truth;

use std::process::ExitCode;

use clap::Parser;
use tracing::level_filters::LevelFilter;

use report::Report;

/// Those that the cup can hold somewhere level. A wide gripper does not get to slopes this near to the table, nor a lip of
/// 20 mm onto balls of 30.
const HELD: [&str; 10] = [
    "box", "plate", "disc", "cylinder", "octagon1", "octagon2", "star", "gear", "cross", "bracket",
];

#[derive(Parser)]
#[command(about = "Measures pick cycles of the simulated cell; see the README for the figures to expect")]
pub(crate) struct Arguments {
    /// Print one JSON object as the last thing on standard output.
    #[arg(long)]
    json: bool,
    /// Objects to pick.
    #[arg(long, default_value_t = 200)]
    picks: usize,
    /// Objects that lie in a world at the same time.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=8))]
    objects: u32,
    /// Kinds of shape, separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "NAMES", default_values = HELD)]
    shapes: Vec<String>,
    /// Of the first world; a miss tells its world's, for `scatter: {seed: ..., count: ..., shapes: [...]}` in a world file.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Most speed of the tool, m/s.
    #[arg(long, default_value_t = 0.95)]
    tool_speed: f64,
    /// Picks before these, at 0.25 m/s, to see what robot time they take.
    #[arg(long, default_value_t = 6)]
    slow_picks: usize,
    /// Runs of solving and planning two views of 1000 x 1000.
    #[arg(long, default_value_t = 9)]
    runs: usize,
}

#[tokio::main]
async fn main() -> anyhow::Result<ExitCode> {
    let arguments = Arguments::parse();
    ros::logging::init(LevelFilter::WARN)?;
    let perception = tokio::task::spawn_blocking(move || perception::measure(arguments.runs)).await??;
    let arguments = Arguments::parse();
    let cell = cell::start(&arguments).await?;
    let slow = picks::run(&cell, &arguments, picks::SLOW, arguments.slow_picks).await?;
    let fast = picks::run(&cell, &arguments, arguments.tool_speed, arguments.picks).await?;
    cell.stop().await?;
    let report = Report::new(&fast, &slow, perception);
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
