//! The node that writes bags.
//!
//! `record/start` ([`StartRecording`]) begins a bag with the images,
//! calibrations and exposures of every camera, the transforms, joint states, and the state of lights and cell;
//! `record/stop` ends it. Results and further topics are recorded when they are asked for. A bag that runs into its
//! `max_duration`, a full disk or the end of the node is ended as well, and stays readable.
//!
//! Recording does not hold up what is recorded: images that a node of the same process publishes are shared, not
//! copied, the file is written on a thread of low priority, and what does not fit into its queue is dropped, counted
//! and reported.
//!
//! It is *not* `ros2 bag record`: it records the topics of the cell and others of the cell's types. The file format is
//! in `recording`.

mod channel;
mod error;
mod parameters;
mod path;
mod recorder;
mod report;
mod session;
mod topics;

pub use error::Error;
pub use topics::RECORDED_TYPES;

use interfaces::rakelight_msgs::srv::StartRecording;
use interfaces::std_srvs::srv::Trigger;
use ros::Node;

use parameters::Parameters;
use recorder::Recorder;

/// Name of the node in launch configs.
pub const NAME: &str = "bag_recorder";

/// Serves `record/start` and `record/stop` until the node is shut down; a bag that is being written is then ended.
pub async fn run(node: Node) -> Result<(), Error> {
    let parameters = Parameters::declare(&node)?;
    let mut starts = node.service_server::<StartRecording>("record/start")?;
    let mut stops = node.service_server::<Trigger>("record/stop")?;
    let mut recorder = Recorder::new(node, parameters);
    tracing::info!("ready");
    loop {
        tokio::select! {
            call = starts.next() => {
                let Some(call) = call else { break };
                let response = recorder.start(call.request()).await;
                respond(call.respond(response).await);
            }
            call = stops.next() => {
                let Some(call) = call else { break };
                let response = recorder.stop().await;
                respond(call.respond(response).await);
            }
            end = recorder.end_of_session() => recorder.end(end).await,
        }
    }
    recorder.shut_down().await;
    Ok(())
}

fn respond(sent: Result<(), ros::Error>) {
    if let Err(error) = sent {
        tracing::warn!(%error, "the caller does not get its answer");
    }
}
