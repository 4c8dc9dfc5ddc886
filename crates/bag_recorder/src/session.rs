//! A bag that is being written.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use recording::{BackgroundWriter, BagWriter, Progress, RecordingError};
use ros::Node;
use tokio::sync::{Notify, mpsc};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep_until};
use tracing::Instrument;

use crate::channel::{Channel, Feed, is_latched, subscribe};
use crate::error::Error;
use crate::topics::Wanted;

/// What was published before the end was asked for may still be on its way: images are waited for until none has come
/// for this long.
const QUIET: Duration = Duration::from_millis(250);
/// And no longer than this.
const DRAIN_LIMIT: Duration = Duration::from_secs(2);

/// A recording under way.
pub(crate) struct Session {
    path: PathBuf,
    feed: Arc<Feed>,
    writer: BackgroundWriter,
    channels: JoinSet<()>,
    failed: Arc<Notify>,
    started: Instant,
    ends_at: Option<Instant>,
}

/// Why a recording ends by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// `max_duration` is over.
    Duration,
    /// The disk refused.
    Failure,
}

/// A recording that is over.
pub(crate) struct Ended {
    pub(crate) path: PathBuf,
    pub(crate) lasted: Duration,
    pub(crate) progress: Progress,
    /// Messages lost on the way to the recorder.
    pub(crate) missed: u64,
    pub(crate) failure: Option<RecordingError>,
}

impl Session {
    /// Subscribes, and waits until the publishers that are there know it.
    pub(crate) async fn start(
        node: &Node,
        wanted: &[Wanted],
        create: impl FnOnce() -> Result<BagWriter, Error>,
        max_queue_bytes: usize,
        max_duration: Option<Duration>,
    ) -> Result<Self, Error> {
        let channels = open(node, wanted)?;
        let mut bag = create()?;
        let mut ids = Vec::with_capacity(channels.len());
        for channel in &channels {
            let (name, kind) = (channel.topic(), channel.type_name());
            ids.push(bag.add_topic(name, kind, channel.definition(), &channel.qos().into())?);
        }
        let path = bag.folder().to_owned();
        let failed = Arc::new(Notify::new());
        let notified = Arc::clone(&failed);
        let writer = BackgroundWriter::start(bag, max_queue_bytes, move || notified.notify_one())?;
        let feed = Arc::new(Feed::new(writer.inlet(), node.clock().clone()));
        let (ready, mut all_ready) = mpsc::channel(1);
        let mut tasks = JoinSet::new();
        for (channel, id) in channels.into_iter().zip(ids) {
            tasks.spawn(channel.record(id, Arc::clone(&feed), ready.clone()).in_current_span());
        }
        drop(ready);
        // Ends when the last sender is dropped.
        while all_ready.recv().await.is_some() {}
        let started = Instant::now();
        Ok(Self {
            path,
            feed,
            writer,
            channels: tasks,
            failed,
            started,
            ends_at: max_duration.map(|duration| started + duration),
        })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn feed(&self) -> &Arc<Feed> {
        &self.feed
    }

    /// Waits until the recording ends by itself. Cancel safe.
    pub(crate) async fn end(&self) -> End {
        let over = async {
            match self.ends_at {
                Some(at) => sleep_until(at).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            () = self.failed.notified() => End::Failure,
            () = over => End::Duration,
        }
    }

    /// Takes what is still on its way.
    pub(crate) async fn drain(&self) {
        let asked = Instant::now();
        loop {
            let quiet_at = self.feed.last_large().max(asked) + QUIET;
            if self.feed.inlet().failure().is_some() || quiet_at <= Instant::now() {
                return;
            }
            sleep_until(quiet_at.min(asked + DRAIN_LIMIT)).await;
            if asked.elapsed() >= DRAIN_LIMIT {
                return;
            }
        }
    }

    /// Ends the bag; returns when the disk has it.
    pub(crate) async fn finish(mut self) -> Ended {
        let lasted = self.started.elapsed();
        self.channels.shutdown().await;
        let inlet = self.feed.inlet().clone();
        let finished = tokio::task::spawn_blocking(move || self.writer.finish()).await;
        let outcome = finished.expect("the writing thread does not panic");
        Ended {
            path: self.path,
            lasted,
            progress: inlet.progress(),
            missed: self.feed.missed(),
            failure: outcome.err(),
        }
    }
}

/// Latched topics come last: a publisher hears of subscriptions in the order in which they are made, so one that has
/// sent what is latched knows the others, too.
fn open(node: &Node, wanted: &[Wanted]) -> Result<Vec<Box<dyn Channel>>, Error> {
    let mut order: Vec<&Wanted> = wanted.iter().collect();
    order.sort_by_key(|topic| is_latched(&topic.name, &topic.type_name));
    let mut channels = Vec::new();
    for topic in order {
        // The list of topics holds only types that have a channel.
        channels.extend(subscribe(node, &topic.name, &topic.type_name)?);
    }
    Ok(channels)
}
