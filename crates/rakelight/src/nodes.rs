//! `rakelight node NAME...`: nodes in one process, until it is asked to end.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use futures::future::BoxFuture;
use ros::{LaunchConfig, Node, NodeOptions, RosArguments};
use tokio::task::JoinSet;
use tracing::Instrument;

use crate::ending::asked_to_end;
use crate::failure::Failure;

/// The nodes that this binary has.
pub(crate) const NODES: [&str; 3] = [bag_player::NAME, bag_recorder::NAME, normal_solver::NAME];

#[derive(Args)]
pub(crate) struct Arguments {
    /// Nodes to run.
    #[arg(required = true, value_parser = clap::builder::PossibleValuesParser::new(NODES))]
    names: Vec<String>,
    /// Launch config with the nodes' parameters.
    #[arg(long)]
    config: Option<PathBuf>,
    /// Namespace of the nodes, unless the config gives one.
    #[arg(long, default_value = "/cell")]
    namespace: String,
    /// End when standard input does: a pipe from the parent closes when the parent dies.
    #[arg(long)]
    end_with_stdin: bool,
}

pub(crate) async fn run(arguments: Arguments, ros_arguments: &RosArguments) -> Result<(), Failure> {
    let config = arguments
        .config
        .map(LaunchConfig::read)
        .transpose()
        .map_err(Failure::usage)?;
    let options = |name: &str| {
        let options = match &config {
            Some(config) => config.node_options(name),
            None => NodeOptions::new(name).namespace(&arguments.namespace),
        };
        ros_arguments.apply_to(options)
    };
    let mut running = Running::default();
    for name in &arguments.names {
        running.start(name, options(name)).await?;
    }
    tokio::select! {
        outcome = running.first_to_end() => outcome?,
        asked = asked_to_end(arguments.end_with_stdin) => asked?,
    }
    running.stop().await;
    Ok(())
}

/// Nodes of this process.
#[derive(Default)]
pub(crate) struct Running {
    nodes: Vec<Node>,
    tasks: JoinSet<anyhow::Result<()>>,
}

impl Running {
    /// Starts a node by its name in launch configs.
    pub(crate) async fn start(&mut self, name: &str, options: NodeOptions) -> Result<Node, Failure> {
        let node = Node::start(options).await.map_err(Failure::usage)?;
        self.nodes.push(node.clone());
        let served = node.clone();
        let task: BoxFuture<anyhow::Result<()>> = match name {
            normal_solver::NAME => Box::pin(async { Ok(normal_solver::run(served).await?) }),
            bag_recorder::NAME => Box::pin(async { Ok(bag_recorder::run(served).await?) }),
            bag_player::NAME => Box::pin(async { Ok(bag_player::run(served).await.map(drop)?) }),
            _ => return Err(Failure::usage(anyhow!("no node {name:?}; known: {}", NODES.join(", ")))),
        };
        self.tasks.spawn(task.instrument(node.span()));
        Ok(node)
    }

    /// Waits until a node ends by itself, or fails.
    pub(crate) async fn first_to_end(&mut self) -> Result<(), Failure> {
        match self.tasks.join_next().await {
            None => Ok(()),
            Some(ended) => ended?.map_err(failure),
        }
    }

    /// Shuts every node down.
    pub(crate) async fn stop(mut self) {
        for node in self.nodes.drain(..) {
            node.shutdown().await;
        }
        while let Some(ended) = self.tasks.join_next().await {
            match ended {
                Ok(Ok(())) => {}
                Ok(Err(error)) => tracing::warn!(%error, "a node ended with an error while stopping"),
                Err(error) => tracing::error!(%error, "a node panicked"),
            }
        }
    }
}

/// A node that refuses its parameters was started wrongly; anything else is the job's failure.
fn failure(error: anyhow::Error) -> Failure {
    let by_solver = matches!(
        error.downcast_ref(),
        Some(normal_solver::Error::Parameter(_) | normal_solver::Error::LightLists { .. })
    );
    let by_player = matches!(
        error.downcast_ref(),
        Some(bag_player::Error::Parameter(_) | bag_player::Error::NoBag)
    );
    let by_recorder = matches!(error.downcast_ref(), Some(bag_recorder::Error::Parameter(_)));
    if by_solver || by_player || by_recorder {
        return Failure::usage(error);
    }
    Failure::from(error)
}
