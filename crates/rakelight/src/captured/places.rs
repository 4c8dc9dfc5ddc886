//! Lenses and poses of the cameras.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::{Context, anyhow};
use geometry::{GeometryError, PinholeCamera, RigidTransform};
use interfaces::sensor_msgs::msg::CameraInfo;
use interfaces::tf2_msgs::msg::TFMessage;
use interfaces::{Message, cdr};
use recording::{Bag, Topic};
use ros::tf::{Buffer, StampedTransform};

/// Bags are shorter.
const KEPT: Duration = Duration::from_hours(366 * 24);
const BASE: &str = "link_base";

/// What a bag says of its cameras.
pub(crate) struct Places {
    transforms: Buffer,
    /// An uncalibrated camera has none, and the reason.
    cameras: BTreeMap<String, Result<PinholeCamera, GeometryError>>,
}

impl Places {
    pub(crate) fn read(bag: &Bag) -> anyhow::Result<Self> {
        let mut places = Self {
            transforms: Buffer::new(KEPT),
            cameras: BTreeMap::new(),
        };
        let wanted = |topic: &Topic| [TFMessage::TYPE_NAME, CameraInfo::TYPE_NAME].contains(&topic.type_name.as_str());
        for message in bag.messages_where(wanted) {
            let message = message?;
            let name = &message.topic.name;
            let read = if message.topic.type_name == TFMessage::TYPE_NAME {
                places.add_transforms(&cdr::from_slice(&message.cdr)?, name.ends_with("tf_static"))
            } else {
                places.add_camera(name, &cdr::from_slice(&message.cdr)?);
                Ok(())
            };
            read.with_context(|| format!("a message on {name}"))?;
        }
        Ok(places)
    }

    fn add_transforms(&self, message: &TFMessage, is_static: bool) -> anyhow::Result<()> {
        for transform in &message.transforms {
            let transform = StampedTransform::from_message(transform)?;
            if is_static {
                self.transforms.insert_static(&transform)?;
            } else {
                self.transforms.insert(&transform)?;
            }
        }
        Ok(())
    }

    fn add_camera(&mut self, topic: &str, info: &CameraInfo) {
        let Some(name) = topic.strip_suffix("/camera_info") else {
            return;
        };
        let size = (info.width as usize, info.height as usize);
        // Who needs no lens reads the images all the same.
        let camera = PinholeCamera::from_camera_info(size.0, size.1, &info.k, &info.distortion_model, &info.d);
        self.cameras.insert(name.to_owned(), camera);
    }

    /// Lens of a camera, by the topics' common beginning.
    pub(crate) fn camera(&self, name: &str) -> anyhow::Result<PinholeCamera> {
        let found = self.cameras.get(name).cloned();
        let found = found.ok_or_else(|| anyhow!("the bag has no {name}/camera_info"))?;
        found.with_context(|| format!("{name}/camera_info"))
    }

    /// Where a frame was at a time.
    pub(crate) fn base_from(&self, frame: &str, nanos: i64) -> anyhow::Result<RigidTransform> {
        Ok(self.transforms.lookup(BASE, frame, nanos)?)
    }
}
