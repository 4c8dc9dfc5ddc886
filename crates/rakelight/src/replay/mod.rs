//! `rakelight replay BAG`: a bag as if it were live.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use ros::{NodeOptions, RosArguments};

use crate::failure::Failure;
use crate::nodes::Running;

/// Seconds that the player waits for the solver to be matched.
const WAIT_FOR_SOLVER: f64 = 10.0;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Bag folder or .mcap file.
    bag: PathBuf,
    /// Recorded seconds per second, 0.01 to 100.
    #[arg(long, default_value_t = 1.0)]
    rate: f64,
    /// Begin anew after the last message, until Ctrl-C.
    #[arg(long)]
    r#loop: bool,
    /// Run the normal solver on what is played.
    #[arg(long)]
    resolve: bool,
    /// Repeat every pixel of images this often in both directions, 1 to 16.
    #[arg(long, default_value_t = 1, value_name = "N")]
    enlarge: i64,
    /// Namespace of the nodes. Topics keep the names they have in the bag.
    #[arg(long, default_value = "/cell")]
    namespace: String,
}

pub(crate) async fn run(arguments: Arguments, ros_arguments: &RosArguments) -> Result<(), Failure> {
    if !arguments.bag.exists() {
        return Err(Failure::usage(anyhow!("no bag at {}", arguments.bag.display())));
    }
    let options = |name: &str| ros_arguments.apply_to(NodeOptions::new(name).namespace(&arguments.namespace));
    let mut running = Running::default();
    if arguments.resolve {
        running.start(normal_solver::NAME, options(normal_solver::NAME)).await?;
    }
    let player = options(bag_player::NAME)
        .parameter("bag", arguments.bag.display().to_string())
        .parameter("rate", arguments.rate)
        .parameter("loop", arguments.r#loop)
        .parameter("enlarge", arguments.enlarge)
        .parameter(
            "wait_for_subscriptions",
            if arguments.resolve { WAIT_FOR_SOLVER } else { 0.0 },
        );
    running.start(bag_player::NAME, player).await?;
    let outcome = tokio::select! {
        outcome = running.first_to_end() => outcome,
        _ = tokio::signal::ctrl_c() => Ok(()),
    };
    running.stop().await;
    outcome
}
