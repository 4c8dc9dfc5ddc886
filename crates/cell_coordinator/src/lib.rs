//! The node that runs pick cycles: capture, solve, plan, execute, and a look whether the object is gone.
//!
//! The service `pick` runs one cycle, the action `pick_cycle` does so with options, feedback and cancel; `state` says what
//! the cell does. The cycle itself is a state machine without ROS and clock; around it, this crate calls the other
//! nodes and listens to the arm. One cycle runs at a time; a node that is gone is noticed within `node_timeout`, and
//! nothing moves without a fresh `arm/state` that says that the arm is ready.
//!
//! A cycle that ends early leaves the arm at rest. The pump is then off, unless something hangs on the cup: that stays
//! there, and the next cycle puts it into the bin first.
//!
//! It is *not* the one who decides how the arm moves or what can be grasped: `trajectory_executor` and `grasp_planner` do.

mod arm;
mod board;
mod convert;
mod cycle;
mod desk;
mod drive;
mod error;
mod hands;
mod parameters;
mod pick;
mod presence;
mod record;

pub use error::Error;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;
use ros::Node;
use tokio::task::JoinSet;
use tracing::Instrument;

use arm::Arm;
use board::Board;
use desk::Desk;
use hands::Hands;
use parameters::Parameters;
use presence::Presence;
use record::Recording;

/// Name of the node in launch configs.
pub const NAME: &str = "cell_coordinator";

/// Runs cycles when asked, until the node is shut down; the arm is then told to stop if it moves for a cycle.
pub async fn run(node: Node) -> Result<(), Error> {
    let parameters = Arc::new(Parameters::declare(&node)?);
    let mut tasks = JoinSet::new();
    let presence = Presence::watch(&node, parameters.node_timeout(), &mut tasks)?;
    let arm = Arm::listen(&node, &mut tasks)?;
    let hands = Hands::new(&node, arm.clone(), presence.clone(), Arc::clone(&parameters))?;
    let desk = Arc::new(Desk {
        hands: Arc::new(hands),
        arm,
        board: Board::new(&node)?,
        recording: Recording::new(&node, presence.clone())?,
        presence,
        parameters,
        clock: node.clock().clone(),
        carried: Mutex::new(None),
        abandoned: AtomicBool::new(false),
    });
    tasks.spawn(tell_idle(Arc::clone(&desk)).in_current_span());
    let service = node.service_server("pick")?;
    tasks.spawn(pick::serve_service(service, Arc::clone(&desk)).in_current_span());
    let action = node.action_server("pick_cycle")?;
    tasks.spawn(pick::serve_action(action, Arc::clone(&desk)).in_current_span());
    tracing::info!("ready");
    node.stop_token().cancelled().await;
    tasks.shutdown().await;
    // In this order: a cycle that is dropped just now is abandoned before the cell is idle.
    if desk.board.is_executing() || desk.abandoned.load(Ordering::SeqCst) {
        desk.hands.halt().await;
    }
    Ok(())
}

/// Whenever somebody comes or goes, or the arm says something.
async fn tell_idle(desk: Arc<Desk>) {
    let (mut presence, mut arm) = (desk.presence.clone(), desk.arm.clone());
    loop {
        desk.tell_idle();
        tokio::select! {
            () = presence.changed() => {}
            state = arm.next() => if state.is_none() { return },
        }
    }
}
