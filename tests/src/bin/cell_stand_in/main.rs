//! A stand-in for one node of the cell in a process of its own, for tests that kill it.
//!
//! There is one object on the table. What `--hang` names is never answered. It prints `ready` when everything is there,
//! and `asked WHAT` for every request.

use clap::Parser;
use ros::{Node, NodeOptions};
use scenarios::stand_ins::{Reply, StandIn, World};

#[derive(Parser)]
struct Options {
    /// Name of the node.
    node: String,
    /// A service, or a leg of a motion, such as `approach`.
    #[arg(long)]
    hang: Option<String>,
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let options = Options::parse();
    let world = World::new(&[0.42]);
    if let Some(what) = &options.hang {
        world.reply(what, Reply::Hang);
    }
    let node = Node::start(NodeOptions::new(&options.node).namespace("/cell")).await?;
    let _stand_in = StandIn::on(node, &options.node, &world);
    println!("ready");
    let (mut changes, mut told) = (world.changes(), 0);
    loop {
        let asked = world.look().asked[told..].to_vec();
        told += asked.len();
        for what in asked {
            println!("asked {what}");
        }
        changes.changed().await?;
    }
}
