//! `rakelight demo`: three picks of the simulated cell, unattended; or a recorded capture through ROS.

mod cell;
pub(crate) mod football;
mod played;
mod summary;
mod tour;
mod viewer;

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use crate::failure::Failure;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Play and solve this bag instead.
    #[arg(long, conflicts_with = "football")]
    bag: Option<PathBuf>,
    /// Solve the photographs of a football in this folder instead.
    #[arg(long, value_name = "DIR", num_args = 0..=1, default_missing_value = "../shared/data/white_football")]
    football: Option<PathBuf>,
    /// Where bags and pictures go.
    #[arg(long, default_value = "demo_output")]
    output: PathBuf,
    /// Objects to pick.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    count: u32,
    /// World file of the cell [default: `launch_configs/worlds/pick.yaml` of this repository].
    #[arg(long)]
    world: Option<PathBuf>,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    let output = &arguments.output;
    std::fs::create_dir_all(output).with_context(|| format!("cannot create {}", output.display()))?;
    match (arguments.bag, &arguments.football) {
        (Some(bag), _) => played::bag(bag, output).await,
        (None, Some(folder)) => played::football(folder, output).await,
        (None, None) => tour::run(output, arguments.count, arguments.world).await,
    }
}
