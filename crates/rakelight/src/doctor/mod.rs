//! `rakelight doctor`: what is missing on this machine, and how to get it.
//!
//! It changes nothing, and asks the network nothing but the cameras of the config, unless `--discover` is given.

mod clocks;
mod devices;
mod finding;
mod kernel;
mod python;
mod ros_graph;
mod simulation;

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::Args;
use ros::LaunchConfig;

use crate::failure::Failure;
use crate::nodes::NODES;
use crate::running_cell;
use crate::up::locate;
use finding::{Finding, Report};

/// A name that no node of a cell has.
const NODE: &str = "doctor";

#[derive(Args)]
pub(crate) struct Arguments {
    /// Launch config of the cell that is to run [default: that of `rakelight up`].
    #[arg(long)]
    config: Option<PathBuf>,
    /// Ask the whole network for cameras.
    #[arg(long)]
    discover: bool,
    /// Tell what was found as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    let path = locate::config(arguments.config).map_err(Failure::usage)?;
    let config = LaunchConfig::read(&path).map_err(Failure::usage)?;
    config.check_nodes(&NODES).map_err(Failure::usage)?;
    let findings = tokio::task::spawn_blocking(move || findings(&config, arguments.discover)).await?;
    let report = Report::new(path.display().to_string(), findings);
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!("{}", report.for_people());
    }
    if report.can_run {
        return Ok(());
    }
    Err(Failure::from(anyhow!(
        "{} cannot run: see what is missing",
        path.display()
    )))
}

fn findings(config: &LaunchConfig, discover: bool) -> Vec<Finding> {
    let root = Path::new("/");
    let repository = locate::repository();
    let shell = std::env::var("PYTHONPATH").ok();
    [
        simulation::check(config),
        devices::check(config, discover),
        kernel::check(root, Path::new(".")),
        clocks::check(root),
        ros_graph::check(&config.node_options(NODE), &running_cell::folder()),
        python::check(repository.as_deref(), shell.as_deref()),
    ]
    .concat()
}
