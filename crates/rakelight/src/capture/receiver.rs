//! Images and what is known of their light, joined by their stamps.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, anyhow};
use interfaces::Message;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::Image;
use ros::{Node, Qos};
use tokio::sync::mpsc;
use tokio::time::{Instant, timeout_at};

/// An image with its exposure.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    pub(super) image: Arc<Image>,
    pub(super) exposure: Arc<Exposure>,
}

/// Frames of one capture by camera, in the order of the sequence.
pub(super) type Frames = BTreeMap<String, Vec<Frame>>;

enum Part {
    Image(Arc<Image>),
    Exposure(Arc<Exposure>),
}

/// Stamp, which with the camera names a frame.
type Stamp = (i32, u32);

/// Listens to cameras.
pub(super) struct Receiver {
    cameras: Vec<String>,
    parts: mpsc::UnboundedReceiver<(String, Part)>,
    images: BTreeMap<(String, Stamp), Arc<Image>>,
    exposures: BTreeMap<(String, Stamp), Arc<Exposure>>,
}

impl Receiver {
    pub(super) fn new(node: &Node, cameras: &[String]) -> Result<Self, ros::Error> {
        let (sender, parts) = mpsc::unbounded_channel();
        for camera in cameras {
            listen(node, camera, "image_raw", Qos::IMAGE, &sender, Part::Image)?;
            listen(node, camera, "exposure", Qos::STREAM, &sender, Part::Exposure)?;
        }
        Ok(Self {
            cameras: cameras.to_vec(),
            parts,
            images: BTreeMap::new(),
            exposures: BTreeMap::new(),
        })
    }

    /// Waits until `count` images of every camera are here with their exposures. What belongs to other captures is
    /// thrown away.
    pub(super) async fn frames(
        &mut self,
        capture_id: &str,
        count: usize,
        patience: Duration,
    ) -> anyhow::Result<Frames> {
        let deadline = Instant::now() + patience;
        loop {
            let frames = self.joined(capture_id);
            if frames.len() == self.cameras.len() && frames.values().all(|frames| frames.len() >= count) {
                self.images.clear();
                self.exposures.clear();
                return Ok(frames);
            }
            match timeout_at(deadline, self.parts.recv()).await {
                Ok(part) => self.take(part.context("the node is shut down")?),
                Err(_) => return Err(self.missing(&frames, count, patience)),
            }
        }
    }

    fn take(&mut self, (camera, part): (String, Part)) {
        match part {
            Part::Image(image) => drop(self.images.insert((camera, stamp(image.header.stamp)), image)),
            Part::Exposure(exposure) => {
                drop(self.exposures.insert((camera, stamp(exposure.header.stamp)), exposure));
            }
        }
    }

    fn joined(&self, capture_id: &str) -> Frames {
        let mut frames = Frames::new();
        for (key, exposure) in &self.exposures {
            if let (true, Some(image)) = (exposure.capture_id == capture_id, self.images.get(key)) {
                frames.entry(key.0.clone()).or_default().push(Frame {
                    image: Arc::clone(image),
                    exposure: Arc::clone(exposure),
                });
            }
        }
        for frames in frames.values_mut() {
            frames.sort_by_key(|frame| frame.exposure.index);
        }
        frames
    }

    fn missing(&self, frames: &Frames, count: usize, patience: Duration) -> anyhow::Error {
        let got: Vec<String> = self
            .cameras
            .iter()
            .map(|camera| format!("{} of {camera}", frames.get(camera).map_or(0, Vec::len)))
            .collect();
        anyhow!(
            "the capture was taken, but after {patience:?} not all of its images are here: {}, {count} each are expected",
            got.join(", ")
        )
    }
}

fn stamp(time: Time) -> Stamp {
    (time.sec, time.nanosec)
}

fn listen<M: Message>(
    node: &Node,
    camera: &str,
    topic: &str,
    qos: Qos,
    sender: &mpsc::UnboundedSender<(String, Part)>,
    part: impl Fn(Arc<M>) -> Part + Send + 'static,
) -> Result<(), ros::Error> {
    let mut subscription = node.subscription::<M>(&format!("{camera}/{topic}"), qos)?;
    let (camera, sender) = (camera.to_owned(), sender.clone());
    tokio::spawn(async move {
        while let Some(received) = subscription.next().await {
            if sender.send((camera.clone(), part(received.message))).is_err() {
                return;
            }
        }
    });
    Ok(())
}
