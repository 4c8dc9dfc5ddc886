//! Typed subscriptions that feed a bag.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use futures::future::BoxFuture;
use interfaces::diagnostic_msgs::msg::DiagnosticArray;
use interfaces::geometry_msgs::msg::PoseStamped;
use interfaces::rakelight_msgs::msg::{ArmState, CellState, Exposure, GraspArray, LightState};
use interfaces::sensor_msgs::msg::{CameraInfo, CompressedImage, Image, JointState, PointCloud2};
use interfaces::std_msgs::msg::String as StringMessage;
use interfaces::tf2_msgs::msg::TFMessage;
use interfaces::{Message, cdr};
use parking_lot::Mutex;
use recording::{Inlet, OfferedQos, TopicId};
use ros::{Clock, Durability, Node, Qos, Reliability, Subscription};
use tokio::sync::mpsc;
use tokio::time::{Instant, timeout_at};

/// Room for the images of two light sequences, should the recorder not get to run for so long.
const IMAGES: Qos = Qos::reliable(32);

/// What was latched before, of every publisher, and everything from now on.
const LATCHED: Qos = Qos::TF_STATIC;

/// How long a latched message may take from a publisher that is there.
const LATCHED_PATIENCE: Duration = Duration::from_secs(1);
/// A publisher that is not known after this long is taken not to be there.
const PUBLISHER_PATIENCE: Duration = Duration::from_millis(300);

/// A topic with a subscription.
pub(crate) trait Channel: Send {
    /// Fully qualified name.
    fn topic(&self) -> &str;
    fn type_name(&self) -> &'static str;
    fn definition(&self) -> &'static str;
    fn qos(&self) -> OfferedQos;
    /// Whether latecomers get its last messages; such topics tell when the publishers know this node.
    fn is_latched(&self) -> bool;
    /// Hands everything that comes to the bag, until the node is shut down. `ready` is dropped when what was latched
    /// has come or will not.
    fn record(self: Box<Self>, id: TopicId, feed: Arc<Feed>, ready: mpsc::Sender<()>) -> BoxFuture<'static, ()>;
}

/// What all channels of a recording share.
pub(crate) struct Feed {
    inlet: Inlet,
    clock: Clock,
    /// When the last large message came.
    last_large: Mutex<Instant>,
    /// Messages that were lost before they came here.
    missed: AtomicU64,
}

impl Feed {
    pub(crate) fn new(inlet: Inlet, clock: Clock) -> Self {
        Self {
            inlet,
            clock,
            last_large: Mutex::new(Instant::now()),
            missed: AtomicU64::new(0),
        }
    }

    pub(crate) fn inlet(&self) -> &Inlet {
        &self.inlet
    }

    /// Messages that gave way in a subscription's queue, or could not be decoded.
    pub(crate) fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// When the last image or other large message came.
    pub(crate) fn last_large(&self) -> Instant {
        *self.last_large.lock()
    }
}

/// Bytes of a large message, without its small fields; `None` for types that are small.
type Weigh<M> = Option<fn(&M) -> usize>;

struct Typed<M: Message> {
    subscription: Subscription<M>,
    qos: Qos,
    weigh: Weigh<M>,
    missed: u64,
}

/// Subscribes; `None` when the type is none of those that can be recorded.
pub(crate) fn subscribe(node: &Node, topic: &str, type_name: &str) -> Result<Option<Box<dyn Channel>>, ros::Error> {
    Ok(Some(match type_name {
        Image::TYPE_NAME => typed::<Image>(node, topic, Some(|m| m.data.len()))?,
        CompressedImage::TYPE_NAME => typed::<CompressedImage>(node, topic, Some(|m| m.data.len()))?,
        PointCloud2::TYPE_NAME => typed::<PointCloud2>(node, topic, Some(|m| m.data.len()))?,
        ArmState::TYPE_NAME => typed::<ArmState>(node, topic, None)?,
        CameraInfo::TYPE_NAME => typed::<CameraInfo>(node, topic, None)?,
        CellState::TYPE_NAME => typed::<CellState>(node, topic, None)?,
        DiagnosticArray::TYPE_NAME => typed::<DiagnosticArray>(node, topic, None)?,
        Exposure::TYPE_NAME => typed::<Exposure>(node, topic, None)?,
        GraspArray::TYPE_NAME => typed::<GraspArray>(node, topic, None)?,
        JointState::TYPE_NAME => typed::<JointState>(node, topic, None)?,
        LightState::TYPE_NAME => typed::<LightState>(node, topic, None)?,
        PoseStamped::TYPE_NAME => typed::<PoseStamped>(node, topic, None)?,
        StringMessage::TYPE_NAME => typed::<StringMessage>(node, topic, None)?,
        TFMessage::TYPE_NAME => typed::<TFMessage>(node, topic, None)?,
        _ => return Ok(None),
    }))
}

/// Whether the cell publishes the topic for latecomers, too.
pub(crate) fn is_latched(topic: &str, type_name: &str) -> bool {
    match type_name {
        CameraInfo::TYPE_NAME | CellState::TYPE_NAME => true,
        TFMessage::TYPE_NAME => topic.ends_with("tf_static"),
        // Text that describes something; other text is said once.
        StringMessage::TYPE_NAME => topic.ends_with("description"),
        _ => false,
    }
}

fn typed<M: Message>(node: &Node, topic: &str, weigh: Weigh<M>) -> Result<Box<dyn Channel>, ros::Error> {
    let qos = match weigh {
        Some(_) => IMAGES,
        None if is_latched(topic, M::TYPE_NAME) => LATCHED,
        None => Qos::STREAM,
    };
    Ok(Box::new(Typed {
        subscription: node.subscription::<M>(topic, qos)?,
        qos,
        weigh,
        missed: 0,
    }))
}

impl<M: Message> Channel for Typed<M> {
    fn topic(&self) -> &str {
        self.subscription.topic()
    }

    fn type_name(&self) -> &'static str {
        M::TYPE_NAME
    }

    fn definition(&self) -> &'static str {
        M::DEFINITION
    }

    fn qos(&self) -> OfferedQos {
        OfferedQos {
            reliable: self.qos.reliability == Reliability::Reliable,
            transient_local: self.is_latched(),
            depth: self.qos.depth as u32,
        }
    }

    fn is_latched(&self) -> bool {
        self.qos.durability == Durability::TransientLocal
    }

    fn record(mut self: Box<Self>, id: TopicId, feed: Arc<Feed>, ready: mpsc::Sender<()>) -> BoxFuture<'static, ()> {
        Box::pin(async move {
            if self.is_latched() {
                self.record_latched(id, &feed).await;
            }
            drop(ready);
            while let Some(received) = self.subscription.next().await {
                self.take(id, received.message, &feed);
            }
        })
    }
}

impl<M: Message> Typed<M> {
    /// The first message of a latched topic, unless nobody publishes it.
    async fn record_latched(&mut self, id: TopicId, feed: &Feed) {
        let started = Instant::now();
        for patience in [PUBLISHER_PATIENCE, LATCHED_PATIENCE] {
            match timeout_at(started + patience, self.subscription.next()).await {
                Ok(Some(received)) => return self.take(id, received.message, feed),
                Ok(None) => return,
                Err(_) if self.subscription.publisher_count() == 0 => return,
                Err(_) => {}
            }
        }
    }

    fn take(&mut self, id: TopicId, message: Arc<M>, feed: &Feed) {
        let log_time = u64::try_from(feed.clock.now_nanos()).unwrap_or(0);
        match self.weigh {
            Some(weigh) => {
                *feed.last_large.lock() = Instant::now();
                let topic = self.topic().to_owned();
                let bytes = weigh(&message);
                feed.inlet
                    .offer(id, log_time, bytes, move || serialise(&topic, &*message));
            }
            None => {
                if let Some(cdr) = serialise(self.topic(), &*message) {
                    feed.inlet.offer(id, log_time, cdr.len(), move || Some(cdr));
                }
            }
        }
        self.count_missed(feed);
    }

    fn count_missed(&mut self, feed: &Feed) {
        let missed = self.subscription.dropped() + self.subscription.unreadable();
        feed.missed.fetch_add(missed - self.missed, Ordering::Relaxed);
        self.missed = missed;
    }
}

fn serialise<M: Message>(topic: &str, message: &M) -> Option<Vec<u8>> {
    cdr::to_vec(message)
        .inspect_err(|error| tracing::warn!(topic, %error, "not recorded"))
        .ok()
}
