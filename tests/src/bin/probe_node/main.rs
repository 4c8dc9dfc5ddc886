//! A real node with a bit of everything, for tests of the ROS layer from outside: images, latched state, services, an
//! action and parameters.
//!
//! | topic, service or action | what it does |
//! |---|---|
//! | `c1/image_raw`, `c1/normals`, `c1/camera_info` | published at `--rate`; see `scenarios::patterns` for the pixels |
//! | `echo/in`, `echo/out` | every image on the first is published on the second |
//! | `~/status` (Trigger) | says how many messages were published |
//! | `~/publish` (`SetBool`) | publishing off and on |
//! | `~/slow` (Trigger) | answers after `--slow-secs` |
//! | `pick_cycle` (action) | feedback for every step; see `goals` |
//!
//! It prints `ready` when everything is there, and `map <width> <age in ms>` for each map with `--watch`.

mod goals;
mod parameters;
mod services;
mod topics;

use std::future::pending;
use std::io;

use clap::Parser;
use ros::{Node, NodeOptions, logging};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::oneshot;
use tracing::level_filters::LevelFilter;

/// Options of the probe.
#[derive(Parser, Debug, Clone)]
pub(crate) struct Options {
    /// Name of the node.
    #[arg(long, default_value = "probe")]
    name: String,
    /// Namespace of the node.
    #[arg(long, default_value = "/cell")]
    namespace: String,
    /// Pixels a side of `c1/image_raw`.
    #[arg(long, default_value_t = 64)]
    image_size: u32,
    /// Pixels a side of `c1/normals`; 1536 makes 28 MB.
    #[arg(long, default_value_t = 64)]
    map_size: u32,
    /// Images and maps a second.
    #[arg(long, default_value_t = 5.0)]
    rate: f64,
    /// Images and maps in all; 0 = without end.
    #[arg(long, default_value_t = 0)]
    count: u64,
    /// Publish the first map when so many subscriptions of it are there.
    #[arg(long, default_value_t = 0)]
    wait_for_readers: usize,
    /// Publish no images and maps.
    #[arg(long)]
    mute: bool,
    /// Print a line for every map that another node publishes on `c1/normals`.
    #[arg(long)]
    watch: bool,
    /// Feedback messages of a goal.
    #[arg(long, default_value_t = 5)]
    steps: u32,
    /// Milliseconds between them.
    #[arg(long, default_value_t = 100)]
    step_millis: u64,
    /// Seconds until `~/slow` answers.
    #[arg(long, default_value_t = 600.0)]
    slow_secs: f64,
    /// Read start values of parameters from this file.
    #[arg(long)]
    parameters: Option<std::path::PathBuf>,
    /// End when standard input does.
    #[arg(long)]
    end_with_stdin: bool,
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    logging::init(LevelFilter::INFO)?;
    let options = Options::parse();
    let mut node_options = NodeOptions::new(&options.name).namespace(&options.namespace);
    if let Some(path) = &options.parameters {
        node_options = node_options.parameter_file(path);
    }
    let node = Node::start(node_options).await?;
    let probe = run(&node, &options);
    tokio::select! {
        outcome = probe => outcome?,
        () = told_to_end(options.end_with_stdin) => {}
    }
    node.shutdown().await;
    Ok(())
}

/// Serves until the node is shut down.
async fn run(node: &Node, options: &Options) -> anyhow::Result<()> {
    let parameters = parameters::declare(node)?;
    let publishing = topics::Publishing::new(options);
    let topics = topics::Topics::new(node, options)?;
    let services = services::Services::new(node)?;
    let goals = node.action_server("pick_cycle")?;
    println!("ready");
    tokio::try_join!(
        topics.serve(node, options, &publishing),
        services.serve(options, &publishing),
        goals::serve(goals, options),
        parameters.watch(),
    )?;
    Ok(())
}

/// Ctrl-C, a request to terminate, or the end of standard input.
async fn told_to_end(with_stdin: bool) {
    let terminated = async {
        match signal(SignalKind::terminate()) {
            Ok(mut signal) => drop(signal.recv().await),
            Err(_) => pending().await,
        }
    };
    let stdin_ended = async {
        if with_stdin {
            end_of_stdin().await;
        } else {
            pending::<()>().await;
        }
    };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        () = terminated => {}
        () = stdin_ended => {}
    }
}

/// Read in a thread of its own: one of the runtime's would hold up the runtime's end.
async fn end_of_stdin() {
    let (ended, wait) = oneshot::channel();
    std::thread::spawn(move || {
        // An error ends it as well.
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        let _ = ended.send(());
    });
    let _ = wait.await;
}
