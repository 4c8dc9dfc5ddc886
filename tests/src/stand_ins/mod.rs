//! Stand-ins for the nodes that a pick cycle calls: same names, services and actions, and behind them a world of a few
//! numbers. They do what they are asked at once and rightly, unless a test tells them how to fail.

mod arm;
mod vision;
mod world;

use ros::Node;
use tokio::task::JoinSet;

pub use world::{HOME, Reply, World};

use crate::domain::Domain;

/// The nodes that a cycle needs.
pub const NODES: [&str; 5] = [
    "light_sequencer",
    "camera_capture",
    "normal_solver",
    "grasp_planner",
    "trajectory_executor",
];

/// A node that runs until this is dropped.
pub struct StandIn {
    node: Node,
    tasks: JoinSet<()>,
}

impl StandIn {
    /// Takes the place of the node `name`.
    ///
    /// # Panics
    ///
    /// When there is no stand-in of that name, or it cannot start.
    pub async fn start(domain: &Domain, name: &str, world: &World) -> Self {
        Self::on(domain.node(name).await, name, world)
    }

    /// The same, on a node that was started.
    ///
    /// # Panics
    ///
    /// When there is no stand-in of that name.
    pub fn on(node: Node, name: &str, world: &World) -> Self {
        let mut tasks = JoinSet::new();
        match name {
            "light_sequencer" => {}
            "camera_capture" => vision::capture(&node, world, &mut tasks),
            "normal_solver" => vision::solve(&node, world, &mut tasks),
            "grasp_planner" => vision::plan(&node, world, &mut tasks),
            "trajectory_executor" => arm::serve(&node, world, &mut tasks),
            "bag_recorder" => vision::record(&node, world, &mut tasks),
            other => panic!("no stand-in {other:?}"),
        }
        Self { node, tasks }
    }

    /// Leaves the graph in good order.
    pub async fn leave(mut self) {
        self.tasks.shutdown().await;
        self.node.shutdown().await;
    }
}
