//! Which topics belong into a bag.

use interfaces::Message;
use interfaces::diagnostic_msgs::msg::DiagnosticArray;
use interfaces::geometry_msgs::msg::PoseStamped;
use interfaces::rakelight_msgs::msg::{ArmState, CellState, Exposure, GraspArray, LightState};
use interfaces::rakelight_msgs::srv::StartRecordingRequest;
use interfaces::sensor_msgs::msg::{CameraInfo, CompressedImage, Image, JointState, PointCloud2};
use interfaces::std_msgs::msg::String as StringMessage;
use interfaces::tf2_msgs::msg::TFMessage;
use ros::Node;

use crate::error::Error;

/// The message types that can be recorded. `bag_player` plays all of them.
pub const RECORDED_TYPES: [&str; 14] = [
    ArmState::TYPE_NAME,
    CameraInfo::TYPE_NAME,
    CellState::TYPE_NAME,
    CompressedImage::TYPE_NAME,
    DiagnosticArray::TYPE_NAME,
    Exposure::TYPE_NAME,
    GraspArray::TYPE_NAME,
    Image::TYPE_NAME,
    JointState::TYPE_NAME,
    LightState::TYPE_NAME,
    PointCloud2::TYPE_NAME,
    PoseStamped::TYPE_NAME,
    StringMessage::TYPE_NAME,
    TFMessage::TYPE_NAME,
];

/// A topic to record, and its type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Wanted {
    /// Relative to the node's namespace, or absolute.
    pub(crate) name: String,
    /// One of [`RECORDED_TYPES`].
    pub(crate) type_name: String,
}

impl Wanted {
    fn new(name: impl Into<String>, type_name: &str) -> Self {
        Self {
            name: name.into(),
            type_name: type_name.to_owned(),
        }
    }
}

/// The topics that `request` asks for, each once.
pub(crate) fn wanted(node: &Node, cameras: &[String], request: &StartRecordingRequest) -> Result<Vec<Wanted>, Error> {
    let mut wanted = session(cameras);
    if request.results {
        wanted.extend(results(cameras));
    }
    for name in &request.topics {
        let full = absolute(node.namespace(), name);
        let is_known = |known: &Wanted| absolute(node.namespace(), &known.name) == full;
        if !wanted.iter().any(is_known) {
            let known = results(cameras).into_iter().chain(further(cameras)).find(is_known);
            wanted.push(match known {
                Some(known) => known,
                None => published(node, full, cameras)?,
            });
        }
    }
    Ok(wanted)
}

/// What every bag of a capture session holds.
fn session(cameras: &[String]) -> Vec<Wanted> {
    let of_camera = |camera: &String| {
        [
            Wanted::new(format!("{camera}/image_raw"), Image::TYPE_NAME),
            Wanted::new(format!("{camera}/camera_info"), CameraInfo::TYPE_NAME),
            Wanted::new(format!("{camera}/exposure"), Exposure::TYPE_NAME),
        ]
    };
    let cell = [
        Wanted::new("/tf", TFMessage::TYPE_NAME),
        Wanted::new("/tf_static", TFMessage::TYPE_NAME),
        Wanted::new("joint_states", JointState::TYPE_NAME),
        Wanted::new("lights/state", LightState::TYPE_NAME),
        Wanted::new("state", CellState::TYPE_NAME),
    ];
    cameras.iter().flat_map(of_camera).chain(cell).collect()
}

/// What the cell computes from it.
fn results(cameras: &[String]) -> Vec<Wanted> {
    let of_camera = |camera: &String| {
        let image = |what: &str| Wanted::new(format!("{camera}/{what}"), Image::TYPE_NAME);
        [
            image("normals"),
            image("confidence"),
            image("mask"),
            image("depth"),
            image("edges"),
            image("edge_confidence"),
            Wanted::new(format!("{camera}/points"), PointCloud2::TYPE_NAME),
        ]
    };
    let cell = [
        Wanted::new("grasps", GraspArray::TYPE_NAME),
        Wanted::new("grasp_pose", PoseStamped::TYPE_NAME),
    ];
    cameras.iter().flat_map(of_camera).chain(cell).collect()
}

/// What the cell publishes beside.
fn further(cameras: &[String]) -> Vec<Wanted> {
    let of_camera = |camera: &String| {
        ["normals", "edges", "grasps"]
            .map(|what| Wanted::new(format!("{camera}/{what}/preview"), CompressedImage::TYPE_NAME))
    };
    let cell = [
        Wanted::new("arm/state", ArmState::TYPE_NAME),
        Wanted::new("/robot_description", StringMessage::TYPE_NAME),
        Wanted::new("/diagnostics", DiagnosticArray::TYPE_NAME),
    ];
    cameras.iter().flat_map(of_camera).chain(cell).collect()
}

/// A topic that is none of the cell's own, by the type that others gave it.
fn published(node: &Node, topic: String, cameras: &[String]) -> Result<Wanted, Error> {
    let Some(type_name) = node.topic_type(&topic)? else {
        let known: Vec<String> = further(cameras).into_iter().map(|known| known.name).collect();
        let known = known.join(", ");
        return Err(Error::UnknownTopic { topic, known });
    };
    if !RECORDED_TYPES.contains(&type_name.as_str()) {
        let known = RECORDED_TYPES.join(", ");
        return Err(Error::UnknownType {
            topic,
            type_name,
            known,
        });
    }
    Ok(Wanted { name: topic, type_name })
}

fn absolute(namespace: &str, name: &str) -> String {
    if name.starts_with('/') {
        return name.to_owned();
    }
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_of_the_cell_has_a_type_that_can_be_recorded() {
        let cameras = ["c1".to_owned(), "c2".to_owned()];
        let all = [session(&cameras), results(&cameras), further(&cameras)].concat();
        assert_eq!(all.len(), 11 + 16 + 9);
        for topic in all {
            assert!(RECORDED_TYPES.contains(&topic.type_name.as_str()), "{topic:?}");
        }
    }

    /// Texts and keys that begin like a topic's name.
    fn names(value: &serde_json::Value, found: &mut Vec<String>) {
        match value {
            serde_json::Value::String(text) => found.push(text.clone()),
            serde_json::Value::Array(values) => values.iter().for_each(|value| names(value, found)),
            serde_json::Value::Object(fields) => {
                for (key, value) in fields {
                    found.push(key.clone());
                    names(value, found);
                }
            }
            _ => {}
        }
        found.retain(|name| name.starts_with('/'));
    }

    #[test]
    fn the_foxglove_layout_shows_topics_that_the_cell_has() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../launch_configs/foxglove.json");
        let text = std::fs::read_to_string(path).expect("the layout");
        let layout: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let mut shown = Vec::new();
        names(&layout, &mut shown);
        let cameras = ["c1".to_owned(), "c2".to_owned()];
        let cell = [session(&cameras), results(&cameras), further(&cameras)].concat();
        let known: Vec<String> = cell.iter().map(|topic| absolute("/cell", &topic.name)).collect();
        for topic in &shown {
            assert!(known.contains(topic), "{topic} is not one of {known:?}");
        }
        for wanted in [
            "/cell/state",
            "/cell/c1/points",
            "/cell/c2/grasps/preview",
            "/robot_description",
        ] {
            assert!(shown.iter().any(|topic| topic == wanted), "{wanted} is not shown");
        }
        let panels = layout["configById"].as_object().expect("panels");
        let placed = layout["layout"].to_string() + &layout["configById"]["Tab!messages"].to_string();
        for panel in panels.keys() {
            assert!(
                placed.contains(&format!("\"{panel}\"")),
                "{panel} is nowhere on the screen"
            );
        }
    }

    #[test]
    fn names_are_taken_below_the_namespace() {
        assert_eq!(absolute("/cell", "arm/state"), "/cell/arm/state");
        assert_eq!(absolute("/", "arm/state"), "/arm/state");
        assert_eq!(absolute("/cell", "/diagnostics"), "/diagnostics");
    }
}
