//! The node that publishes a recorded bag as if it were live.
//!
//! Topics keep their names (remapping applies) and messages their stamps and their distances in time. A topic whose
//! type the cell does not know is named and left out; so is a message that cannot be decoded.
//!
//! It is *not* `ros2 bag play`: it publishes the types of the cell, decoded, so that nodes in the same process take them
//! over without a copy.

mod channel;
mod enlarge;
mod error;
mod parameters;

pub use error::Error;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use recording::{Bag, RawMessage};
use ros::Node;
use tokio::sync::mpsc;
use tokio::time::Instant;

use channel::Channel;
use parameters::Parameters;

/// Name of the node in launch configs.
pub const NAME: &str = "bag_player";

/// Messages read ahead of their time.
const READ_AHEAD: usize = 8;

/// What was played.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Played {
    /// Messages published.
    pub published: usize,
    /// Messages left out, each with a warning.
    pub left_out: usize,
}

/// Plays the bag of parameter `bag` once, or until the node is shut down when `loop` is set.
pub async fn run(node: Node) -> Result<Played, Error> {
    let parameters = Parameters::declare(&node)?;
    let bag = Arc::new(open(&parameters)?);
    let left_out = parameters.leave_out.get();
    let channels = channels(&node, &bag, &left_out, parameters.enlarge.get() as usize)?;
    wait_for_subscriptions(&channels, &parameters).await?;
    let stop = node.stop_token();
    let mut played = Played::default();
    loop {
        let round = play(Arc::clone(&bag), &channels, &left_out, parameters.rate.get());
        tokio::select! {
            () = stop.cancelled() => return Ok(played),
            round = round => {
                played.published += round.published;
                played.left_out += round.left_out;
            }
        }
        tracing::info!(
            published = played.published,
            left_out = played.left_out,
            "the bag is at its end"
        );
        if !parameters.repeat.get() {
            deliver(&channels).await;
            return Ok(played);
        }
    }
}

fn open(parameters: &Parameters) -> Result<Bag, Error> {
    let path = parameters.bag.get();
    if path.is_empty() {
        return Err(Error::NoBag);
    }
    let bag = Bag::open(&path)?;
    for damage in &bag.report().damage {
        tracing::warn!(file = %damage.file.display(), offset = damage.offset, reason = damage.reason, "damaged; the rest is played");
    }
    Ok(bag)
}

fn channels(
    node: &Node,
    bag: &Bag,
    left_out: &[String],
    factor: usize,
) -> Result<BTreeMap<String, Box<dyn Channel>>, Error> {
    let mut channels = BTreeMap::new();
    let mut unknown = Vec::new();
    for topic in bag.topics().iter().filter(|topic| !left_out.contains(&topic.name)) {
        match channel::open(node, &topic.name, &topic.type_name, factor)? {
            Some(channel) => drop(channels.insert(topic.name.clone(), channel)),
            None => unknown.push(format!("{} ({})", topic.name, topic.type_name)),
        }
    }
    let unknown = unknown.join(", ");
    if channels.is_empty() {
        let files = bag.report().files.iter().map(|file| file.display().to_string());
        let reason = if unknown.is_empty() {
            "it has no topics beside those left out".into()
        } else {
            format!("unknown types: {unknown}")
        };
        return Err(Error::NothingToPlay {
            bag: files.collect::<Vec<_>>().join(", "),
            reason,
        });
    }
    if !unknown.is_empty() {
        tracing::warn!(topics = unknown, "not played: types that the cell does not know");
    }
    Ok(channels)
}

/// Image topics are volatile: what is published before somebody listens is lost.
async fn wait_for_subscriptions(
    channels: &BTreeMap<String, Box<dyn Channel>>,
    parameters: &Parameters,
) -> Result<(), Error> {
    const LOOK_AGAIN: Duration = Duration::from_millis(20);
    let patience = Duration::from_secs_f64(parameters.wait_for_subscriptions.get());
    let deadline = Instant::now() + patience;
    let unheard = || {
        let needed = channels
            .values()
            .filter(|c| ["image_raw", "exposure"].iter().any(|end| c.topic().ends_with(end)));
        needed
            .into_iter()
            .find(|c| c.subscriptions() == 0)
            .map(|c| c.topic().to_owned())
    };
    while !patience.is_zero() {
        let Some(topic) = unheard() else { break };
        if Instant::now() >= deadline {
            return Err(Error::NobodyListens {
                topic,
                waited: patience,
            });
        }
        tokio::time::sleep(LOOK_AGAIN).await;
    }
    Ok(())
}

/// The last messages are still on their way when they are published; a publisher that ends takes them with it.
async fn deliver(channels: &BTreeMap<String, Box<dyn Channel>>) {
    let waiting = channels
        .values()
        .map(|channel| async { (channel.topic(), channel.acknowledged().await) });
    for (topic, acknowledged) in futures::future::join_all(waiting).await {
        if !acknowledged {
            tracing::warn!(topic, "a reader has not acknowledged the last messages");
        }
    }
}

/// One round through the bag.
async fn play(bag: Arc<Bag>, channels: &BTreeMap<String, Box<dyn Channel>>, left_out: &[String], rate: f64) -> Played {
    let (sender, mut messages) = mpsc::channel(READ_AHEAD);
    let left_out = left_out.to_vec();
    tokio::task::spawn_blocking(move || read(&bag, &left_out, &sender));
    let mut played = Played::default();
    let mut beginning: Option<(u64, Instant)> = None;
    while let Some(message) = messages.recv().await {
        let Some(channel) = channels.get(&message.topic.name) else {
            played.left_out += 1;
            continue;
        };
        let (first, started) = *beginning.get_or_insert_with(|| (message.log_time, Instant::now()));
        let offset = Duration::from_nanos(message.log_time.saturating_sub(first));
        tokio::time::sleep_until(started + offset.div_f64(rate)).await;
        match channel.publish(&message.cdr) {
            Ok(()) => played.published += 1,
            Err(error) => {
                played.left_out += 1;
                tracing::warn!(topic = message.topic.name, log_time = message.log_time, %error, "a message is left out");
            }
        }
    }
    played
}

fn read(bag: &Bag, left_out: &[String], sender: &mpsc::Sender<RawMessage>) {
    for message in bag.messages_where(|topic| !left_out.contains(&topic.name)) {
        match message {
            // The receiver is gone when the player was stopped.
            Ok(message) => match sender.blocking_send(message) {
                Ok(()) => {}
                Err(_) => return,
            },
            Err(error) => tracing::warn!(%error, "a message cannot be read; it is left out"),
        }
    }
}
