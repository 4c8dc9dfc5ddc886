//! The node of the lights: it drives the light controller for everybody else.
//!
//! `lights/run_sequence` runs one sequence and answers with the times of its steps on the ROS clock; `lights/set` lights
//! panels by hand, or turns everything off, which also aborts a sequence. `lights/state` says what is on, on every change
//! and once a second. What was refused or failed is in the answer, in the state and in the log.
//!
//! It is *not* the driver (`light_serial`), and it decides nothing: which panels, for how long and in which order is up
//! to its callers, and the firmware has the last word.

mod convert;
mod diagnostics;
mod error;
mod parameters;
mod record;
mod services;
mod state;

pub use error::Error;

use std::sync::Arc;

use devices::LightBank;
use light_serial::{LightController, LightSerialConfig};
use ros::Node;
use tokio::task::JoinSet;
use tracing::Instrument;

use parameters::Parameters;
use record::Record;
use services::Services;

/// Name of the node in launch configs.
pub const NAME: &str = "light_sequencer";

/// Serves the lights until the node is shut down; then they are off.
pub async fn run(node: Node) -> Result<(), Error> {
    let parameters = Parameters::declare(&node)?;
    let port = parameters.port.get();
    let lights = Arc::new(LightController::open(LightSerialConfig::new(&port)));
    let record = Arc::new(Record::default());
    let publisher = node.publisher(state::TOPIC, ros::Qos::STREAM)?;
    let services = Services::new(&node, parameters, Arc::clone(&lights), Arc::clone(&record))?;
    let mut tasks = JoinSet::new();
    let publishing = state::publish(node.clone(), publisher, Arc::clone(&lights), record);
    tasks.spawn(publishing.in_current_span());
    services.spawn_into(&mut tasks);
    diagnostics::register(node.diagnostics(), &port, &lights);
    tracing::info!(port, "ready");
    node.stop_token().cancelled().await;
    node.diagnostics().unregister(diagnostics::PART);
    // Ends what is under way: a sequence that nobody waits for is aborted.
    tasks.shutdown().await;
    close(lights).await;
    Ok(())
}

/// The lights are off when this returns, if the controller can be reached; it turns them off by itself if not.
async fn close(lights: Arc<LightController>) {
    if let Err(error) = lights.off().await {
        tracing::debug!(%error, "the lights were not turned off at the end");
    }
    // Somebody may still be looking at it; the port is closed with the last handle.
    if let Some(lights) = Arc::into_inner(lights) {
        lights.close().await;
    }
}
