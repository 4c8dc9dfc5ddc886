//! The node of the cameras: takes captures.
//!
//! A capture is eight images of every camera: one without light, one under each panel. The node arms the cameras, asks
//! the node of the lights for one sequence, which pulses the cameras' trigger lines, and joins the frames with the steps
//! that the light controller timed. Counts, intervals, sizes and times must agree; otherwise the capture is void,
//! nothing of it is published, and it is repeated once. The service answers as soon as the capture is known to be whole;
//! its images follow on `<camera>/image_raw`, each with `<camera>/exposure` and `<camera>/camera_info` of the same stamp.
//!
//! | service | does |
//! |---|---|
//! | `capture` | one capture of the named cameras, of all when none is named |
//! | `~/auto_exposure` | sets every exposure so that the brightest pixels are at 80 % of full scale |
//! | `~/set_light_reference` | makes the brightness of the panels now what later drift is measured from |
//!
//! One capture is taken at a time; a caller that comes meanwhile waits for its turn (four may wait, a fifth is refused).
//! Changed image parameters hold from the next capture on; values that a camera refuses are put back with a warning.
//! `/diagnostics` tells of every camera and of the lights: dead, fading and swapped panels, and ambient light.
//!
//! It is *not* a driver and has no arithmetic of its own: cameras are [`camera_aravis`]'s, lights another node's, and
//! what images say about lights and exposure is in [`photometric`].
//!
//! ```no_run
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! let options = ros::NodeOptions::new(camera_capture::NAME)
//!     .namespace("/cell")
//!     .parameter("cameras", vec!["c1".to_owned()])
//!     .parameter("c1.guid", "192.168.40.11");
//! camera_capture::run(ros::Node::start(options).await?).await?;
//! # Ok(())
//! # }
//! ```

mod auto_exposure;
mod camera;
mod camera_parameters;
mod convert;
mod error;
mod join;
mod keeper;
mod light_watch;
mod lights;
mod parameters;
mod place;
mod publish;
mod record;
mod service;
mod session;

pub use error::Error;

use std::sync::Arc;

use ros::{Node, tf};
use tokio::sync::Mutex;
use tokio::task::JoinSet;
use tracing::Instrument;

use camera::CaptureCamera;
use keeper::Keeper;
use light_watch::LightWatch;
use lights::Lights;
use parameters::Parameters;
use publish::PublishQueue;
use service::{Desk, Servers};
use session::Session;

/// Name of the node in launch configs.
pub const NAME: &str = "camera_capture";

/// Takes captures until the node is shut down; then the lights are off and no camera listens to its trigger.
pub async fn run(node: Node) -> Result<(), Error> {
    let parameters = Parameters::declare(&node)?;
    let names = parameters.cameras.get();
    let cameras = names
        .iter()
        .map(|name| CaptureCamera::open(&node, name))
        .collect::<Result<Vec<_>, _>>()?;
    node.parameters().seal()?;
    let _places = tell_places(&node, &cameras)?;
    let mut tasks = JoinSet::new();
    let queues = publish_queues(&node, &cameras, &mut tasks)?;
    let (health, base) = (parameters.health.clone(), parameters.base_frame_id.get());
    let (watch, samples) = LightWatch::new(&node, &cameras, health, base)?;
    tasks.spawn(watch.clone().run(samples).in_current_span());
    let keepers: Vec<Keeper> = cameras.iter().enumerate().map(keeper).collect();
    let session = Arc::new(Mutex::new(Session {
        cameras,
        lights: Lights::new(&node)?,
        parameters,
        clock: node.clock().clone(),
    }));
    for keeper in keepers {
        tasks.spawn(keeper.run(Arc::clone(&session)).in_current_span());
    }
    let desk = Desk::new(Arc::clone(&session), queues, watch, node.clock().clone());
    let servers = Servers {
        capture: node.service_server("capture")?,
        auto_exposure: node.service_server("~/auto_exposure")?,
        set_light_reference: node.service_server("~/set_light_reference")?,
    };
    tracing::info!(cameras = ?names, "ready");
    servers.run(desk).await;
    tasks.shutdown().await;
    // A capture may have been under way.
    session.lock().await.lights.leave_off().await;
    Ok(())
}

fn keeper((at, camera): (usize, &CaptureCamera)) -> Keeper {
    Keeper {
        name: camera.name.clone(),
        camera: at,
        parameters: camera.parameters.image.clone(),
        record: camera.record.clone(),
        link: camera.link(),
    }
}

fn publish_queues(node: &Node, cameras: &[CaptureCamera], tasks: &mut JoinSet<()>) -> Result<Vec<PublishQueue>, Error> {
    let mut queues = Vec::new();
    for camera in cameras {
        let queue = PublishQueue::new(node, &camera.name, camera.record.clone())?;
        tasks.spawn(queue.clone().run().in_current_span());
        queues.push(queue);
    }
    Ok(queues)
}

/// Tells on `/tf_static` where the cameras are, as long as the broadcaster is kept.
fn tell_places(node: &Node, cameras: &[CaptureCamera]) -> Result<Option<tf::StaticBroadcaster>, Error> {
    let stamp = node.clock().now_nanos();
    let place = |camera: &CaptureCamera| {
        let (place, frame) = (camera.place.as_ref()?, camera.parameters.frame_id.get());
        let pose = place.parent_from_camera;
        Some(tf::StampedTransform::new(&place.parent_frame_id, &frame, stamp, pose))
    };
    let places: Vec<_> = cameras.iter().filter_map(place).collect();
    if places.is_empty() {
        return Ok(None);
    }
    let broadcaster = tf::StaticBroadcaster::new(node)?;
    broadcaster.send(&places)?;
    Ok(Some(broadcaster))
}
