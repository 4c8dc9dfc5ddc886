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
pub(crate) const NODES: [&str; 8] = [
    bag_player::NAME,
    bag_recorder::NAME,
    camera_capture::NAME,
    cell_coordinator::NAME,
    grasp_planner::NAME,
    light_sequencer::NAME,
    normal_solver::NAME,
    trajectory_executor::NAME,
];

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
            grasp_planner::NAME => Box::pin(async { Ok(grasp_planner::run(served).await?) }),
            bag_recorder::NAME => Box::pin(async { Ok(bag_recorder::run(served).await?) }),
            camera_capture::NAME => Box::pin(async { Ok(camera_capture::run(served).await?) }),
            cell_coordinator::NAME => Box::pin(async { Ok(cell_coordinator::run(served).await?) }),
            light_sequencer::NAME => Box::pin(async { Ok(light_sequencer::run(served).await?) }),
            trajectory_executor::NAME => Box::pin(async { Ok(trajectory_executor::run(served).await?) }),
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
    use {
        bag_player as player, bag_recorder as recorder, camera_capture as capture, cell_coordinator as coordinator,
        grasp_planner as planner, light_sequencer as lights, normal_solver as solver, trajectory_executor as executor,
    };
    let player = matches!(
        error.downcast_ref(),
        Some(player::Error::Parameter(_) | player::Error::NoBag)
    );
    let recorder = matches!(error.downcast_ref(), Some(recorder::Error::Parameter(_)));
    let capture = matches!(
        error.downcast_ref(),
        Some(
            capture::Error::Parameter(_)
                | capture::Error::Cameras { .. }
                | capture::Error::Camera { .. }
                | capture::Error::Settings { .. }
                | capture::Error::Pose { .. }
        )
    );
    let lights = matches!(error.downcast_ref(), Some(lights::Error::Parameter(_)));
    let solver = matches!(
        error.downcast_ref(),
        Some(solver::Error::Parameter(_) | solver::Error::LightLists { .. })
    );
    let executor = matches!(
        error.downcast_ref(),
        Some(executor::Error::Parameter(_) | executor::Error::Description { .. } | executor::Error::Value { .. })
    );
    let planner = matches!(
        error.downcast_ref(),
        Some(planner::Error::Parameter(_) | planner::Error::Description { .. } | planner::Error::Value { .. })
    );
    let coordinator = matches!(
        error.downcast_ref(),
        Some(coordinator::Error::Parameter(_) | coordinator::Error::Value { .. })
    );
    if player || recorder || capture || coordinator || lights || solver || executor || planner {
        return Failure::usage(error);
    }
    Failure::from(error)
}
