//! The node that turns solved captures into ranked grasps.
//!
//! It listens to what `normal_solver` publishes of each camera, to `<camera>/exposure` (which says what capture a stamp
//! belongs to), `<camera>/camera_info` and TF, and keeps the last captures. On a call of `plan_grasp` it plans on one of
//! them, with one view or two, fills in poses of the tool and joint angles, publishes `grasps`, `grasp_pose` (the best)
//! and `<camera>/grasps/preview`, and answers with the grasps or with what was looked at and why it was refused.
//!
//! It is *not* the one who knows what the arm may do: joint angles are those of the arm as drawn, without collisions; the
//! executor plans and checks every motion again. The maths is in `grasp` and `kinematics`; this crate converts, calls and
//! publishes.

mod captures;
mod collector;
mod convert;
mod error;
mod joiner;
mod messages;
mod parameters;
mod planning;
mod publish;
mod reach;
mod request;
mod service;
mod summary;
mod view;

pub use error::Error;

use std::sync::Arc;

use ros::{Node, tf};
use tracing::Instrument;

use captures::Captures;
use collector::Collector;
use parameters::Parameters;
use publish::Publishers;
use reach::Reach;
use service::Desk;

/// Name of the node in launch configs.
pub const NAME: &str = "grasp_planner";

/// Plans when asked, until the node is shut down.
pub async fn run(node: Node) -> Result<(), Error> {
    let parameters = Parameters::declare(&node)?;
    parameters.settings()?;
    let reach = Reach::load(&parameters)?;
    let cameras = parameters.cameras.clone();
    let captures = Captures::default();
    let transforms = Arc::new(tf::Listener::new(&node)?);
    let mut collectors = tokio::task::JoinSet::new();
    for camera in &cameras {
        let transforms = Arc::clone(&transforms);
        let collector = Collector::new(&node, camera, &parameters, transforms, captures.clone())?;
        collectors.spawn(collector.run().in_current_span());
    }
    let desk = Desk {
        captures,
        publishers: Publishers::new(&node, &cameras)?,
        parameters,
        reach: Arc::new(reach),
        clock: node.clock().clone(),
    };
    let server = node.service_server("plan_grasp")?;
    tracing::info!(?cameras, "ready");
    desk.serve(server).await;
    collectors.join_all().await;
    Ok(())
}
