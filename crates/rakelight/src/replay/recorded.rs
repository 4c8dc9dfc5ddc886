//! What a bag holds of results.

use std::collections::BTreeMap;
use std::path::Path;

use interfaces::rakelight_msgs::msg::GraspArray;
use interfaces::sensor_msgs::msg::Image;
use interfaces::{Message, cdr};
use recording::{Bag, Topic};

use crate::bag::captures::Capture;

/// Ends of topics that solver and planner publish.
const RESULTS: [&str; 14] = [
    "normals",
    "confidence",
    "mask",
    "depth",
    "edges",
    "edge_confidence",
    "points",
    "albedo",
    "shadows",
    "normals/preview",
    "edges/preview",
    "grasps/preview",
    "grasps",
    "grasp_pose",
];

/// Topics that would be played beside what solver and planner publish anew.
pub(super) fn result_topics(bag: &Path) -> anyhow::Result<Vec<String>> {
    let bag = Bag::open(bag)?;
    let names = bag.topics().iter().filter(|topic| is_result(topic));
    Ok(names.map(|topic| topic.name.clone()).collect())
}

pub(super) fn is_result(topic: &Topic) -> bool {
    let ends_so = |end: &&str| topic.name.strip_suffix(*end).is_some_and(|rest| rest.ends_with('/'));
    RESULTS.iter().any(ends_so)
}

/// Results of one capture.
#[derive(Default)]
pub(super) struct Recorded {
    /// By camera, `/cell/c1`.
    pub(super) normals: BTreeMap<String, Image>,
    pub(super) edges: BTreeMap<String, Image>,
    /// Of the last plan.
    pub(super) grasps: Option<GraspArray>,
}

impl Recorded {
    pub(super) fn read(bag: &Bag, capture: &Capture) -> anyhow::Result<Self> {
        let mut found = Self::default();
        let wanted = |topic: &Topic| [Image::TYPE_NAME, GraspArray::TYPE_NAME].contains(&topic.type_name.as_str());
        for message in bag.messages_where(|topic| is_result(topic) && wanted(topic)) {
            let message = message?;
            if message.topic.type_name == GraspArray::TYPE_NAME {
                let grasps: GraspArray = cdr::from_slice(&message.cdr)?;
                if grasps.capture_id == capture.id {
                    found.grasps = Some(grasps);
                }
                continue;
            }
            let Some((camera, what)) = message.topic.name.rsplit_once('/') else {
                continue;
            };
            let maps = match what {
                "normals" => &mut found.normals,
                "edges" => &mut found.edges,
                _ => continue,
            };
            let map: Image = cdr::from_slice(&message.cdr)?;
            if Some(map.header.stamp.to_nanos()) == first_stamp(capture, camera) {
                maps.insert(camera.to_owned(), map);
            }
        }
        Ok(found)
    }
}

/// The stamp that a camera's results of a capture carry: its first image's, nanoseconds.
pub(super) fn first_stamp(capture: &Capture, camera: &str) -> Option<i64> {
    let part = capture.cameras.iter().find(|part| part.camera == camera)?;
    part.exposures.first().map(|exposure| exposure.stamp)
}
