//! The rakelight command line.

mod bag;
mod calibrate;
mod capture;
mod captured;
mod demo;
mod doctor;
mod ending;
mod eval;
mod failure;
mod image_message;
mod nodes;
mod pick;
mod place;
mod relief;
mod replay;
mod running_cell;
mod sim;
mod solve;
mod up;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use ros::RosArguments;
use tracing::level_filters::LevelFilter;

use failure::Failure;

#[derive(Parser)]
#[command(
    name = "rakelight",
    version,
    about = "A robot cell that sees by shading",
    propagate_version = true
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Bring the cell up (simulated by default) and keep it up; Ctrl-C takes it down.
    Up(up::Arguments),
    /// Pick objects with a running cell and put them into the bin.
    Pick(pick::Arguments),
    /// Take a capture with a running cell: one image of each camera under each light.
    Capture(capture::Arguments),
    /// Say what is missing on this machine and how to get it.
    Doctor(doctor::Arguments),
    /// Serve a simulated world's cameras and lights, for drivers to open as if they were hardware.
    Sim(sim::Arguments),
    /// Measure what the cell has to know of its parts, and write it into a file.
    Calibrate(calibrate::Arguments),
    /// Solve a bag's captures offline: normals into a new bag, pictures.
    Solve(solve::Arguments),
    /// Play a recorded capture through ROS, solve it and write its normal map as a picture.
    Demo(demo::Arguments),
    /// Publish a bag as if it were live.
    Replay(replay::Arguments),
    /// Look into a bag, check it, or cut a part out of it.
    Bag(bag::Arguments),
    /// Say how far results are from the truth.
    Eval(eval::Arguments),
    /// Run nodes in one process until Ctrl-C.
    Node(nodes::Arguments),
}

#[tokio::main]
async fn main() -> ExitCode {
    match run().await {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("rakelight: {failure:#}");
            failure.exit_code()
        }
    }
}

async fn run() -> Result<(), Failure> {
    let (own, ros_arguments) = RosArguments::split(std::env::args()).map_err(Failure::usage)?;
    let arguments = Arguments::parse_from(own);
    ros::logging::init(LevelFilter::INFO).map_err(Failure::usage)?;
    match arguments.command {
        Command::Up(arguments) => up::run(arguments, &ros_arguments).await,
        Command::Pick(arguments) => pick::run(arguments).await,
        Command::Capture(arguments) => capture::run(arguments).await,
        Command::Doctor(arguments) => doctor::run(arguments).await,
        Command::Sim(arguments) => sim::run(arguments).await,
        Command::Calibrate(arguments) => calibrate::run(arguments).await,
        Command::Solve(arguments) => solve::run(arguments).await,
        Command::Demo(arguments) => demo::run(arguments).await,
        Command::Replay(arguments) => replay::run(arguments, &ros_arguments).await,
        Command::Bag(arguments) => bag::run(arguments),
        Command::Eval(arguments) => eval::run(arguments).await,
        Command::Node(arguments) => nodes::run(arguments, &ros_arguments).await,
    }
}
