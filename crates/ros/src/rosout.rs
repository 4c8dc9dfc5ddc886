//! `/rosout`: what the process logs through `tracing`, for everybody in the graph.
//!
//! A record belongs to the node whose fully qualified name stands in its field `node`, or in that field of a span
//! around it (see [`crate::Node::span`]); else to the process's first node. Logging never waits: records go into a
//! bounded queue, a task of the node publishes them, and when the queue is full they are counted and dropped.
//!
//! What the middleware itself logs stays off `/rosout`, for publishing it would make it log again.

use std::cell::Cell;
use std::fmt::{self, Write as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use interfaces::rcl_interfaces::msg::Log;
use parking_lot::RwLock;
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;

use crate::clock::Clock;
use crate::error::Error;
use crate::publisher::Publisher;
use crate::qos::{Durability, Qos};

/// ROS's own `/rosout` profile: what was said before a listener came is worth hearing.
pub(crate) const QOS: Qos = Qos {
    durability: Durability::TransientLocal,
    ..Qos::reliable(1000)
};

/// Records that wait for the publishing task.
const QUEUE: usize = 1000;

/// Records that are published in one go.
const BATCH: usize = 64;

/// Their records would cause new ones.
const MIDDLEWARE: [&str; 3] = ["rustdds", "ros2_client", "mio"];

/// Nodes of this process that publish, in the order in which they started.
static OUTLETS: RwLock<Vec<Arc<Outlet>>> = RwLock::new(Vec::new());

thread_local! {
    /// Set while this thread publishes records.
    static PUBLISHING: Cell<bool> = const { Cell::new(false) };
}

/// One node's way to `/rosout`.
struct Outlet {
    node: String,
    /// The name that ROS loggers have: `/cell/normal_solver` is `cell.normal_solver`.
    logger: String,
    clock: Clock,
    queue: mpsc::Sender<Log>,
    lost: AtomicU64,
}

/// Publishes until the node stops; what is queued then is still published.
pub(crate) fn outlet(
    node: &str,
    clock: Clock,
    publisher: Publisher<Log>,
    stop: CancellationToken,
) -> impl Future<Output = ()> + use<> {
    let (queue, records) = mpsc::channel(QUEUE);
    let logger = node.trim_start_matches('/').replace('/', ".");
    let outlet = Arc::new(Outlet {
        node: node.to_owned(),
        logger,
        clock,
        queue,
        lost: AtomicU64::new(0),
    });
    let registered = Registered(Arc::clone(&outlet));
    OUTLETS.write().push(outlet);
    run(registered, Arc::new(publisher), records, stop)
}

/// Takes the outlet off the list when its task ends, however it ends.
struct Registered(Arc<Outlet>);

impl Drop for Registered {
    fn drop(&mut self) {
        OUTLETS.write().retain(|outlet| !Arc::ptr_eq(outlet, &self.0));
    }
}

async fn run(
    registered: Registered,
    publisher: Arc<Publisher<Log>>,
    mut records: mpsc::Receiver<Log>,
    stop: CancellationToken,
) {
    let mut batch = Vec::with_capacity(BATCH);
    loop {
        let stopped = tokio::select! {
            _ = records.recv_many(&mut batch, BATCH) => false,
            () = stop.cancelled() => true,
        };
        if stopped {
            records.close();
            while records.recv_many(&mut batch, BATCH).await > 0 {}
        }
        batch.extend(registered.0.take_lost());
        let (publisher, records) = (Arc::clone(&publisher), std::mem::take(&mut batch));
        // A slow listener makes `publish` block, which tasks must not.
        let published = tokio::task::spawn_blocking(move || publish_all(&publisher, records)).await;
        if stopped || published.is_err() {
            return;
        }
    }
}

fn publish_all(publisher: &Publisher<Log>, records: Vec<Log>) {
    PUBLISHING.set(true);
    for record in records {
        // To say that it failed would only make another record that cannot be published.
        let _: Result<(), Error> = publisher.publish(record);
    }
    PUBLISHING.set(false);
}

impl Outlet {
    fn take_lost(&self) -> Option<Log> {
        let lost = self.lost.swap(0, Ordering::Relaxed);
        (lost > 0).then(|| Log {
            stamp: self.clock.now(),
            level: Log::WARN,
            name: self.logger.clone(),
            msg: format!("{lost} log records were dropped: more than {QUEUE} were waiting"),
            ..Log::default()
        })
    }

    fn put(&self, record: Log) {
        if self.queue.try_send(record).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The [`Layer`] that feeds `/rosout`; [`crate::logging::init`] installs it.
#[derive(Debug, Default)]
pub struct RosoutLayer;

/// The field `node` of a span.
struct SpanNode(String);

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for RosoutLayer {
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let mut fields = Fields::default();
        attributes.record(&mut fields);
        if let (Some(node), Some(span)) = (fields.node, context.span(id)) {
            span.extensions_mut().insert(SpanNode(node));
        }
    }

    fn on_event(&self, event: &Event<'_>, context: Context<'_, S>) {
        if PUBLISHING.get() || OUTLETS.read().is_empty() {
            return;
        }
        let mut fields = Fields::default();
        event.record(&mut fields);
        if MIDDLEWARE
            .iter()
            .any(|name| fields.target(event.metadata()).starts_with(name))
        {
            return;
        }
        let node = fields.node.clone().or_else(|| {
            let spans = context.event_scope(event)?;
            let named = |span: tracing_subscriber::registry::SpanRef<'_, S>| {
                span.extensions().get::<SpanNode>().map(|n| n.0.clone())
            };
            spans.into_iter().find_map(named)
        });
        let outlets = OUTLETS.read();
        let own = outlets.iter().find(|outlet| Some(&outlet.node) == node.as_ref());
        if let Some(outlet) = own.or(outlets.first()) {
            if let (None, Some(node)) = (own, node) {
                // It belongs to nobody here, so who it speaks of must stand in it.
                let _ = write!(fields.others, " node={node}");
            }
            outlet.put(fields.into_log(event.metadata(), outlet, own.is_some()));
        }
    }
}

/// What a record says beside its metadata.
#[derive(Default)]
struct Fields {
    node: Option<String>,
    message: String,
    others: String,
    /// Records of the `log` crate carry their origin in fields.
    log_target: Option<String>,
}

impl Visit for Fields {
    fn record_str(&mut self, field: &Field, value: &str) {
        match field.name() {
            "node" => self.node = Some(value.to_owned()),
            "log.target" => self.log_target = Some(value.to_owned()),
            _ => self.record_debug(field, &format_args!("{value}")),
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        // Writing to a String cannot fail.
        let _ = match field.name() {
            "node" => {
                self.node = Some(format!("{value:?}").trim_matches('"').to_owned());
                Ok(())
            }
            "message" => write!(self.message, "{value:?}"),
            name if name.starts_with("log.") => Ok(()),
            name => write!(self.others, " {name}={value:?}"),
        };
    }
}

impl Fields {
    fn target<'a>(&'a self, metadata: &'a Metadata<'_>) -> &'a str {
        self.log_target.as_deref().unwrap_or(metadata.target())
    }

    fn into_log(self, metadata: &Metadata<'_>, outlet: &Outlet, is_own: bool) -> Log {
        let target = self.target(metadata).replace("::", ".");
        Log {
            stamp: outlet.clock.now(),
            level: severity(*metadata.level()),
            name: if is_own { outlet.logger.clone() } else { target.clone() },
            msg: self.message + &self.others,
            file: metadata.file().unwrap_or_default().to_owned(),
            function: target,
            line: metadata.line().unwrap_or_default(),
        }
    }
}

/// ROS knows nothing below debug.
fn severity(level: Level) -> u8 {
    match level {
        Level::ERROR => Log::ERROR,
        Level::WARN => Log::WARN,
        Level::INFO => Log::INFO,
        _ => Log::DEBUG,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing_subscriber::layer::SubscriberExt;

    /// An outlet without a publisher: what is logged within `log` and would be published.
    fn logged(node: &str, depth: usize, log: impl FnOnce()) -> (Vec<Log>, Option<Log>) {
        // The list of outlets belongs to the process, so tests that use it take turns.
        static TURN: parking_lot::Mutex<()> = parking_lot::Mutex::new(());
        let _turn = TURN.lock();
        let (queue, mut records) = mpsc::channel(depth);
        let logger = node.trim_start_matches('/').replace('/', ".");
        let outlet = Arc::new(Outlet {
            node: node.into(),
            logger,
            clock: Clock::new(),
            queue,
            lost: AtomicU64::new(0),
        });
        let registered = Registered(Arc::clone(&outlet));
        OUTLETS.write().push(outlet);
        tracing::subscriber::with_default(tracing_subscriber::registry().with(RosoutLayer), log);
        let lost = registered.0.take_lost();
        drop(registered);
        (std::iter::from_fn(|| records.try_recv().ok()).collect(), lost)
    }

    #[test]
    fn records_of_a_node_carry_its_logger_and_all_fields() {
        let (records, lost) = logged("/cell/solver", 10, || {
            tracing::warn!(node = "/cell/solver", pixels = 3, path = "a.png", "dark");
        });
        let [record] = &records[..] else { panic!("{records:?}") };
        assert_eq!(
            (record.name.as_str(), record.msg.as_str()),
            ("cell.solver", "dark pixels=3 path=a.png")
        );
        assert_eq!(record.level, Log::WARN);
        assert!(record.file.ends_with("rosout.rs") && record.line > 0 && record.stamp.sec > 0);
        assert!(lost.is_none());
    }

    #[test]
    fn a_span_says_whose_record_it_is() {
        let (records, _) = logged("/cell/solver", 10, || {
            let _span = tracing::info_span!("node", node = "/cell/solver").entered();
            let _inner = tracing::info_span!("capture", id = 7).entered();
            tracing::info!("inside");
        });
        assert_eq!(records[0].name, "cell.solver");
    }

    #[test]
    fn records_of_nobody_go_out_under_their_module() {
        let (records, _) = logged("/cell/solver", 10, || tracing::error!(node = "arm", "lost"));
        assert_eq!(
            (records[0].name.as_str(), records[0].level),
            ("ros.rosout.tests", Log::ERROR)
        );
        assert_eq!(records[0].msg, "lost node=arm");
    }

    #[test]
    fn the_middleware_and_the_publishing_thread_are_not_heard() {
        let (records, _) = logged("/cell/solver", 10, || {
            tracing::error!(target: "rustdds::rtps::writer", "x");
            tracing::error!(log.target = "rustdds::network", "x");
            PUBLISHING.set(true);
            tracing::error!("x");
            PUBLISHING.set(false);
        });
        assert_eq!(records, []);
    }

    #[test]
    fn a_full_queue_drops_and_counts() {
        let (records, lost) = logged("/cell/solver", 2, || (0..5).for_each(|n| tracing::info!(n, "x")));
        assert_eq!(records.len(), 2);
        assert!(lost.unwrap().msg.starts_with("3 log records were dropped"));
    }
}
