//! Publishing transforms.

use std::collections::BTreeMap;

use interfaces::tf2_msgs::msg::TFMessage;
use parking_lot::Mutex;

use super::message::StampedTransform;
use crate::error::Error;
use crate::node::Node;
use crate::publisher::Publisher;
use crate::qos::Qos;

/// Tells on `/tf` where moving frames are.
pub struct Broadcaster {
    publisher: Publisher<TFMessage>,
}

impl Broadcaster {
    /// A broadcaster of this node.
    pub fn new(node: &Node) -> Result<Self, Error> {
        Ok(Self {
            publisher: node.publisher("/tf", Qos::STREAM)?,
        })
    }

    /// Publishes transforms, all in one message.
    pub fn send(&self, transforms: &[StampedTransform]) -> Result<(), Error> {
        let transforms = transforms.iter().map(StampedTransform::to_message).collect();
        self.publisher.publish(TFMessage { transforms })
    }
}

/// Tells on `/tf_static` where frames always are; who comes later is told as well.
pub struct StaticBroadcaster {
    publisher: Publisher<TFMessage>,
    sent: Mutex<BTreeMap<String, StampedTransform>>,
}

impl StaticBroadcaster {
    /// A broadcaster of this node. One per node is enough.
    pub fn new(node: &Node) -> Result<Self, Error> {
        // Late joiners get the last message only, so every message holds all transforms.
        Ok(Self {
            publisher: node.publisher("/tf_static", Qos::LATCHED)?,
            sent: Mutex::default(),
        })
    }

    /// Publishes transforms beside those sent before; of the same frame, the new one holds.
    pub fn send(&self, transforms: &[StampedTransform]) -> Result<(), Error> {
        let mut sent = self.sent.lock();
        sent.extend(
            transforms
                .iter()
                .map(|transform| (transform.child.clone(), transform.clone())),
        );
        let transforms = sent.values().map(StampedTransform::to_message).collect();
        self.publisher.publish(TFMessage { transforms })
    }
}
