//! The node that turns a capture's images into a normal map.
//!
//! It takes `<camera>/image_raw` with `<camera>/exposure` (which says what light was on), collects a capture until it is
//! whole, solves it, and publishes `<camera>/normals` (`32FC3`, unit vectors in the base frame, NaN where there is no
//! measurement) with `<camera>/normals/preview` for people. With calibrated panels (`lights.file`) it also publishes
//! `confidence`, `mask` (the objects' pixels), `depth`, `edges`, `edge_confidence` and `points`; without, lights are far
//! away and there are normals alone. A capture that cannot be solved is named with the reason; nothing stale or partial
//! is published. Service `solve` answers when a capture is solved, or says why it is not.
//!
//! The maths is in `photometric`; this crate converts, calls and publishes.

mod assembler;
mod camera;
mod captures;
mod convert;
mod error;
mod far_field;
mod lights;
mod near_field;
mod parameters;
mod results;
mod service;

pub use error::Error;

use std::sync::Arc;

use ros::Node;
use ros::tf;
use tracing::Instrument;

use camera::CameraSolver;
use captures::Captures;
use near_field::NearField;
use parameters::Parameters;
use service::Desk;

/// Name of the node in launch configs.
pub const NAME: &str = "normal_solver";

/// Serves every configured camera until the node is shut down.
pub async fn run(node: Node) -> Result<(), Error> {
    let parameters = Arc::new(Parameters::declare(&node)?);
    parameters.check_lights()?;
    let panels = NearField::read(&parameters.lights_file.get())?.map(Arc::new);
    if panels.is_none() {
        tracing::warn!("no lights.file: lights are taken to be far away, and normals are off by 10 degrees and more");
    }
    let transforms = Arc::new(tf::Listener::new(&node)?);
    let captures = Captures::default();
    let mut solvers = tokio::task::JoinSet::new();
    for camera in parameters.cameras.get() {
        let solver = CameraSolver::new(
            &node,
            &camera,
            Arc::clone(&parameters),
            panels.clone(),
            Arc::clone(&transforms),
            captures.clone(),
        )?;
        solvers.spawn(solver.run().in_current_span());
    }
    let desk = Desk {
        captures,
        cameras: parameters.cameras.get(),
        solve_timeout: parameters.solve_timeout.clone(),
        clock: node.clock().clone(),
    };
    let server = node.service_server("solve")?;
    tracing::info!(cameras = ?parameters.cameras.get(), "ready");
    desk.serve(server).await;
    solvers.join_all().await;
    Ok(())
}
