//! What every generated type can do.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::LazyLock;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A message, or a part of a service or action.
pub trait Message: Serialize + DeserializeOwned + Clone + Debug + PartialEq + Default + Send + Sync + 'static {
    /// The full ROS name, such as `sensor_msgs/msg/Image` or `std_srvs/srv/Trigger_Request`.
    const TYPE_NAME: &'static str;
    /// The interface file's text and that of every message it needs, in MCAP's `ros2msg` form.
    const DEFINITION: &'static str;
}

/// A service: its request and its response.
pub trait Service: Send + Sync + 'static {
    /// What the client sends.
    type Request: Message;
    /// What the server answers.
    type Response: Message;
    /// The full ROS name, such as `std_srvs/srv/Trigger`.
    const TYPE_NAME: &'static str;
}

/// An action: its goal, its result and its feedback.
pub trait Action: Send + Sync + 'static {
    /// What the client wants.
    type Goal: Message;
    /// What came of it.
    type Result: Message;
    /// How far it is.
    type Feedback: Message;
    /// The full ROS name, such as `rakelight_msgs/action/PickCycle`.
    const TYPE_NAME: &'static str;
}

/// Something to do with every message type; see [`crate::visit_messages`].
pub trait MessageVisitor {
    /// Called once per type.
    fn visit<M: Message>(&mut self);
}

/// The [`Message::DEFINITION`] of the type of this full ROS name, if this crate has it.
pub fn definition(type_name: &str) -> Option<&'static str> {
    DEFINITIONS.get(type_name).copied()
}

static DEFINITIONS: LazyLock<BTreeMap<&'static str, &'static str>> = LazyLock::new(|| {
    let mut collector = Definitions(BTreeMap::new());
    crate::visit_messages(&mut collector);
    collector.0
});

struct Definitions(BTreeMap<&'static str, &'static str>);

impl MessageVisitor for Definitions {
    fn visit<M: Message>(&mut self) {
        self.0.insert(M::TYPE_NAME, M::DEFINITION);
    }
}
