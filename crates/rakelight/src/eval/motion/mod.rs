//! `rakelight eval motion`: a pick planned as the cell plans it, with every limit beside what it reaches.

mod extremes;
mod panel;
mod pick;
mod plot;

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use imaging::encode_png;
use kinematics::Chain;
use trajectory::{Planner, TrajectoryLimits};

use crate::failure::Failure;
use extremes::Report;

const ARM: &str = include_str!("../../../../../urdf/xarm7.urdf");

#[derive(Args)]
pub(crate) struct Arguments {
    /// Draw positions, speeds, accelerations, jerks and the tool's speed over time into this file.
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Largest speed of the tool, 0.01 to 0.95 m/s.
    #[arg(long, value_name = "M/S", default_value_t = 0.25, value_parser = tool_speed)]
    tool_speed: f64,
    /// Largest acceleration of a joint, rad/s^2.
    #[arg(long, value_name = "RAD/S^2", default_value_t = 10.0)]
    acceleration: f64,
    /// Largest jerk of a joint, rad/s^3.
    #[arg(long, value_name = "RAD/S^3", default_value_t = 200.0)]
    jerk: f64,
    /// Tell the figures as one JSON object.
    #[arg(long)]
    json: bool,
}

fn tool_speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if (0.01..=0.95).contains(&speed) {
        return Ok(speed);
    }
    Err(format!("{speed} m/s, allowed are 0.01 to 0.95"))
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    tokio::task::spawn_blocking(move || evaluate(&arguments)).await?
}

fn evaluate(arguments: &Arguments) -> Result<(), Failure> {
    let planner = planner(arguments).map_err(Failure::usage)?;
    let pick = pick::plan(&planner)?;
    let report = Report::of(&planner, &pick)?;
    if let Some(file) = &arguments.png {
        let picture = plot::draw(&planner, &pick)?;
        let bytes = encode_png(&picture).context("cannot encode the picture")?;
        std::fs::write(file, bytes).with_context(|| format!("cannot write {}", file.display()))?;
    }
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print!("{report}");
    }
    Ok(())
}

fn planner(arguments: &Arguments) -> anyhow::Result<Planner<7>> {
    let robot = urdf_rs::read_from_string(ARM)?;
    let chain = Chain::from_urdf(&robot, "link_base", "link_tcp")?;
    let limits = TrajectoryLimits::of_chain(&chain, arguments.acceleration, arguments.jerk, arguments.tool_speed)?;
    Ok(Planner::new(chain, limits)?)
}
