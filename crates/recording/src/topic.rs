//! What a bag knows about a topic.

use std::fmt::Write as _;

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// With its namespace, `/cell/c1/image_raw`.
    pub name: String,
    /// `sensor_msgs/msg/Image`.
    pub type_name: String,
    /// How its messages are encoded, `cdr` from ROS 2; others pass through untouched.
    pub message_encoding: String,
    /// How `definition` is written, `ros2msg` from ROS 2.
    pub definition_encoding: String,
    /// The message definition with its dependencies.
    pub definition: String,
    /// Quality of service and type hash, as recorded.
    pub options: TopicOptions,
    /// Messages that can be read.
    pub message_count: u64,
}

/// What a topic carries beside its type.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TopicOptions {
    /// YAML sequence of rosbag2 QoS profiles; empty when unknown.
    pub offered_qos_profiles: String,
    /// `RIHS01_...`; empty when unknown.
    pub type_hash: String,
}

impl TopicOptions {
    /// Whether a publisher kept its last messages for latecomers, as far as the bag says.
    pub fn is_transient_local(&self) -> bool {
        // Older bags hold the middleware's number instead of the word.
        let is_said = |line: &str| matches!(line.trim(), "durability: transient_local" | "durability: 1");
        self.offered_qos_profiles.lines().any(is_said)
    }
}

/// The part of a publisher's quality of service a player needs to offer the same again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OfferedQos {
    /// Reliable rather than best effort.
    pub reliable: bool,
    /// Latecomers get the last messages.
    pub transient_local: bool,
    /// Messages kept.
    pub depth: u32,
}

impl Default for OfferedQos {
    /// Reliable, volatile, depth 10: ROS 2's own default.
    fn default() -> Self {
        Self {
            reliable: true,
            transient_local: false,
            depth: 10,
        }
    }
}

impl OfferedQos {
    /// In rosbag2's YAML of version 9, with no deadlines.
    fn to_yaml(self) -> String {
        let reliability = if self.reliable { "reliable" } else { "best_effort" };
        let durability = if self.transient_local {
            "transient_local"
        } else {
            "volatile"
        };
        let mut yaml = format!("- history: keep_last\n  depth: {}\n", self.depth);
        let _ = writeln!(yaml, "  reliability: {reliability}\n  durability: {durability}");
        for limit in ["deadline", "lifespan", "liveliness_lease_duration"] {
            let _ = writeln!(yaml, "  {limit}:\n    sec: 9223372036\n    nsec: 854775807");
        }
        yaml + "  liveliness: automatic\n  avoid_ros_namespace_conventions: false\n"
    }
}

impl From<OfferedQos> for TopicOptions {
    fn from(qos: OfferedQos) -> Self {
        Self {
            offered_qos_profiles: qos.to_yaml(),
            type_hash: String::new(),
        }
    }
}
