//! `rakelight replay BAG`: a bag as if it were live, and what the cell makes of it today.

mod bench;
mod compare;
mod outcome;
mod pictures;
mod recorded;
mod resolve;
mod settings;

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use ros::{NodeOptions, RosArguments};

use crate::failure::Failure;
use crate::nodes::Running;
use settings::Settings;

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
    /// Run the solver and the planner on what is played, in place of recorded results. Unless it loops: one capture after
    /// the other, each compared with what was recorded of it; exit code 1 when they differ.
    #[arg(long)]
    resolve: bool,
    /// Resolve this capture alone, by its number or id in `bag info`.
    #[arg(long, value_name = "N|ID", requires = "resolve", conflicts_with = "loop")]
    cycle: Option<String>,
    /// Write pictures into this folder: normals, edges and grasps, recorded ones to the left of new ones.
    #[arg(long, value_name = "DIR", requires = "resolve", conflicts_with_all = ["loop", "enlarge"])]
    png: Option<PathBuf>,
    /// Print what was found and compared as JSON.
    #[arg(long, requires = "resolve", conflicts_with = "loop")]
    json: bool,
    /// Launch config whose parameters solver and planner take [default: the simulated cell's; none with --loop].
    #[arg(long, value_name = "FILE", requires = "resolve")]
    config: Option<PathBuf>,
    /// Calibration of the lights [default: the launch config's]; without one they are far away and nothing is planned.
    #[arg(long, value_name = "FILE", requires = "resolve")]
    lights: Option<PathBuf>,
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
    let settings = arguments.resolve.then(|| Settings::read(&arguments)).transpose()?;
    let nodes = Nodes {
        arguments: &arguments,
        ros_arguments,
    };
    let mut running = Running::default();
    let outcome = tokio::select! {
        outcome = play(&nodes, settings, &mut running) => outcome,
        _ = tokio::signal::ctrl_c() => Ok(()),
    };
    running.stop().await;
    outcome
}

async fn play(nodes: &Nodes<'_>, settings: Option<Settings>, running: &mut Running) -> Result<(), Failure> {
    let arguments = nodes.arguments;
    let Some(settings) = settings else {
        return running.play(nodes.player(&arguments.bag)).await;
    };
    if !arguments.r#loop {
        return resolve::every_capture(nodes, &settings, running).await;
    }
    settings.start_nodes(nodes, running).await?;
    let results = recorded::result_topics(&arguments.bag)?;
    let player = nodes.player(&arguments.bag);
    let player = player.parameter("loop", true).parameter("leave_out", results);
    running
        .play(player.parameter("wait_for_subscriptions", WAIT_FOR_SOLVER))
        .await
}

/// How nodes of this command start.
struct Nodes<'a> {
    arguments: &'a Arguments,
    ros_arguments: &'a RosArguments,
}

impl Nodes<'_> {
    fn options(&self, name: &str) -> NodeOptions {
        let options = NodeOptions::new(name).namespace(&self.arguments.namespace);
        self.ros_arguments.apply_to(options)
    }

    fn player(&self, bag: &std::path::Path) -> NodeOptions {
        self.options(bag_player::NAME)
            .parameter("bag", bag.display().to_string())
            .parameter("rate", self.arguments.rate)
            .parameter("enlarge", self.arguments.enlarge)
    }
}

impl Running {
    /// Until the player is done, or any node fails.
    async fn play(&mut self, player: NodeOptions) -> Result<(), Failure> {
        let player = self.start(bag_player::NAME, player).await?;
        let outcome = self.first_to_end().await;
        player.shutdown().await;
        outcome
    }
}
