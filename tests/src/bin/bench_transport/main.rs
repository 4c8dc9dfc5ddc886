//! Measures how whole images travel: between Rust and rclpy, between processes and inside one.
//!
//! Every pairing runs in processes of its own, on a domain of its own, over loopback, with the kernel's default
//! buffers. A message carries the time just before `publish`; its latency ends when the subscriber has it decoded in
//! its hands. rclpy to rclpy in the same run is the yardstick.

mod peer;
mod report;
mod run;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Parser, Subcommand};
use tracing::level_filters::LevelFilter;

#[derive(Parser)]
#[command(about = "Measures the transport of images; see the README for the figures to expect")]
struct Arguments {
    #[command(subcommand)]
    role: Option<Role>,
    /// Print one JSON object as the last thing on standard output.
    #[arg(long)]
    json: bool,
    /// Messages of each pairing and size.
    #[arg(long, default_value_t = 30)]
    count: usize,
    /// Seconds for which 28 MB maps are sent at 1 Hz while the sender's memory is watched.
    #[arg(long, default_value_t = 60)]
    memory_seconds: u64,
    /// Python interpreter with rclpy, by default the one that the set-up made; without one the rclpy pairings are left
    /// out, and the report says so.
    #[arg(long, env = "RAKELIGHT_VENV_PYTHON")]
    python: Option<PathBuf>,
}

/// What a child process of the benchmark does.
#[derive(Subcommand, Clone)]
enum Role {
    /// Sends images.
    Publish(peer::Task),
    /// Receives images.
    Subscribe(peer::Task),
    /// Does nothing, for some seconds.
    Idle {
        /// How long.
        seconds: u64,
    },
}

#[tokio::main]
async fn main() -> anyhow::Result<ExitCode> {
    let arguments = Arguments::parse();
    ros::logging::init(LevelFilter::WARN)?;
    match arguments.role {
        Some(Role::Publish(task)) => peer::publish(&task).await?,
        Some(Role::Subscribe(task)) => peer::subscribe(&task).await?,
        Some(Role::Idle { seconds }) => peer::idle(Duration::from_secs(seconds)).await?,
        None => {
            let python = arguments.python.or_else(python_of_the_setup);
            let report = run::everything(arguments.count, arguments.memory_seconds, python.as_deref()).await?;
            println!("{report}");
            if arguments.json {
                println!("{}", serde_json::to_string(&report)?);
            }
            return Ok(if report.complete() {
                ExitCode::SUCCESS
            } else {
                ExitCode::FAILURE
            });
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn python_of_the_setup() -> Option<PathBuf> {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.setup/venv/bin/python");
    python.exists().then_some(python)
}
