//! Typed publishers for recorded topics. Messages are decoded, so that subscribers in this process get them without a
//! copy and a damaged message is named instead of passed on.

use std::time::Duration;

use futures::future::BoxFuture;
use interfaces::diagnostic_msgs::msg::DiagnosticArray;
use interfaces::geometry_msgs::msg::PoseStamped;
use interfaces::rakelight_msgs::msg::{ArmState, CellState, Exposure, GraspArray, LightState};
use interfaces::sensor_msgs::msg::{CameraInfo, CompressedImage, Image, JointState, PointCloud2};
use interfaces::std_msgs::msg::String as StringMessage;
use interfaces::tf2_msgs::msg::TFMessage;
use interfaces::{Message, cdr};
use ros::{Node, Publisher, Qos};

use crate::enlarge;
use crate::error::Error;

/// How long a slow reader may take for the last messages.
const ACKNOWLEDGEMENT_PATIENCE: Duration = Duration::from_secs(5);

/// A topic that can be played.
pub(crate) trait Channel: Send + Sync {
    fn publish(&self, cdr: &[u8]) -> Result<(), Error>;
    fn topic(&self) -> &str;
    fn subscriptions(&self) -> usize;
    /// Whether every reader has what was published, once it has or after [`ACKNOWLEDGEMENT_PATIENCE`].
    fn acknowledged(&self) -> BoxFuture<'_, bool>;
}

struct Typed<M: Message> {
    publisher: Publisher<M>,
    /// What happens to a message between the bag and the wire.
    edit: Box<dyn Fn(M) -> Result<M, Error> + Send + Sync>,
}

impl<M: Message> Channel for Typed<M> {
    fn publish(&self, cdr: &[u8]) -> Result<(), Error> {
        let message = (self.edit)(cdr::from_slice(cdr)?)?;
        Ok(self.publisher.publish(message)?)
    }

    fn topic(&self) -> &str {
        self.publisher.topic()
    }

    fn subscriptions(&self) -> usize {
        self.publisher.subscription_count()
    }

    fn acknowledged(&self) -> BoxFuture<'_, bool> {
        Box::pin(self.publisher.wait_for_acknowledgements(ACKNOWLEDGEMENT_PATIENCE))
    }
}

/// A channel for a topic, or `None` when its type is not one that the cell knows.
pub(crate) fn open(
    node: &Node,
    topic: &str,
    type_name: &str,
    factor: usize,
) -> Result<Option<Box<dyn Channel>>, Error> {
    let unchanged = |qos| (node, topic, qos);
    Ok(Some(match type_name {
        Image::TYPE_NAME => typed(node, topic, image_qos(topic), move |m: Image| {
            enlarge::image(&m, factor)
        })?,
        CameraInfo::TYPE_NAME => typed(node, topic, Qos::LATCHED, move |m| enlarge::camera_info(&m, factor))?,
        Exposure::TYPE_NAME => plain::<Exposure>(unchanged(Qos::STREAM))?,
        CompressedImage::TYPE_NAME => plain::<CompressedImage>(unchanged(Qos::MAP))?,
        PointCloud2::TYPE_NAME => plain::<PointCloud2>(unchanged(Qos::MAP))?,
        JointState::TYPE_NAME => plain::<JointState>(unchanged(Qos::STREAM))?,
        TFMessage::TYPE_NAME if topic.ends_with("tf_static") => plain::<TFMessage>(unchanged(Qos::TF_STATIC))?,
        TFMessage::TYPE_NAME => plain::<TFMessage>(unchanged(Qos::STREAM))?,
        LightState::TYPE_NAME => plain::<LightState>(unchanged(Qos::STREAM))?,
        CellState::TYPE_NAME => plain::<CellState>(unchanged(Qos::LATCHED))?,
        ArmState::TYPE_NAME => plain::<ArmState>(unchanged(Qos::STREAM))?,
        GraspArray::TYPE_NAME => plain::<GraspArray>(unchanged(Qos::STREAM))?,
        PoseStamped::TYPE_NAME => plain::<PoseStamped>(unchanged(Qos::STREAM))?,
        DiagnosticArray::TYPE_NAME => plain::<DiagnosticArray>(unchanged(Qos::STREAM))?,
        StringMessage::TYPE_NAME => plain::<StringMessage>(unchanged(Qos::LATCHED))?,
        _ => return Ok(None),
    }))
}

/// Raw images come in sequences, of which none may be lost; of result maps only the newest counts.
fn image_qos(topic: &str) -> Qos {
    if topic.ends_with("image_raw") {
        Qos::IMAGE
    } else {
        Qos::MAP
    }
}

fn plain<M: Message>((node, topic, qos): (&Node, &str, Qos)) -> Result<Box<dyn Channel>, Error> {
    typed::<M>(node, topic, qos, Ok)
}

fn typed<M: Message>(
    node: &Node,
    topic: &str,
    qos: Qos,
    edit: impl Fn(M) -> Result<M, Error> + Send + Sync + 'static,
) -> Result<Box<dyn Channel>, Error> {
    let publisher = node.publisher::<M>(topic, qos)?;
    Ok(Box::new(Typed {
        publisher,
        edit: Box::new(edit),
    }))
}
