//! Publishing images, in order, without keeping anybody waiting.
//!
//! Publishing blocks while a reliable reader outside the process is slow, so every camera has a queue and a task of its
//! own. The queue holds a few captures; when readers are slower than that, the oldest capture that waits is given up,
//! with a warning.

use std::collections::VecDeque;
use std::sync::Arc;

use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use parking_lot::Mutex;
use ros::{Node, Publisher, Qos};
use tokio::sync::Notify;

use crate::convert::ExposureMessages;
use crate::record::CameraRecord;

/// Captures that wait for slow readers, beside the one that is being published.
const QUEUE: usize = 2;

/// One camera's share of a capture.
pub(crate) struct Job {
    pub(crate) capture_id: String,
    pub(crate) messages: Vec<ExposureMessages>,
}

/// One camera's captures on their way out. Clones are handles to the same queue.
#[derive(Clone)]
pub(crate) struct PublishQueue {
    camera: String,
    record: CameraRecord,
    inner: Arc<Inner>,
}

#[derive(Default)]
struct Inner {
    jobs: Mutex<VecDeque<Job>>,
    arrived: Notify,
}

/// One camera's topics.
pub(crate) struct Publishers {
    exposures: Publisher<Exposure>,
    infos: Publisher<CameraInfo>,
    images: Publisher<Image>,
}

impl Publishers {
    pub(crate) fn new(node: &Node, camera: &str) -> Result<Self, ros::Error> {
        Ok(Self {
            exposures: node.publisher(&format!("{camera}/exposure"), Qos::STREAM)?,
            infos: node.publisher(&format!("{camera}/camera_info"), Qos::LATCHED)?,
            images: node.publisher(&format!("{camera}/image_raw"), Qos::IMAGE)?,
        })
    }

    /// Exposure and camera first: who gets the image then has all that it needs.
    fn publish(&self, messages: ExposureMessages) -> Result<(), ros::Error> {
        // Readers of this process get each of them even where an outside reader of another is stuck.
        let published = [
            self.exposures.publish(messages.exposure),
            self.infos.publish(messages.info),
            self.images.publish(messages.image),
        ];
        published.into_iter().collect()
    }
}

impl PublishQueue {
    pub(crate) fn new(camera: &str, record: CameraRecord) -> Self {
        Self {
            camera: camera.to_owned(),
            record,
            inner: Arc::default(),
        }
    }

    /// Publishes a capture soon.
    pub(crate) fn push(&self, job: Job) {
        let mut jobs = self.inner.jobs.lock();
        jobs.push_back(job);
        let given_up = if jobs.len() > QUEUE { jobs.pop_front() } else { None };
        drop(jobs);
        self.inner.arrived.notify_one();
        if let Some(job) = given_up {
            self.record.unpublished();
            tracing::warn!(
                camera = self.camera,
                capture_id = job.capture_id,
                images = job.messages.len(),
                "not published: readers of the captures before are too slow"
            );
        }
    }

    async fn next(&self) -> Job {
        loop {
            let arrived = self.inner.arrived.notified();
            if let Some(job) = self.inner.jobs.lock().pop_front() {
                return job;
            }
            arrived.await;
        }
    }

    /// Publishes until the caller ends this task; the image that is on its way then is the last.
    pub(crate) async fn run(self, publishers: Publishers) {
        let publishers = Arc::new(publishers);
        // What blocks cannot be cancelled, but it can look whether anybody still waits for it.
        let running = Arc::new(());
        loop {
            let job = self.next().await;
            let (publishers, camera) = (Arc::clone(&publishers), self.camera.clone());
            let running = Arc::downgrade(&running);
            let publish = move || {
                let Job { capture_id, messages } = job;
                for messages in messages.into_iter().take_while(|_| running.strong_count() > 0) {
                    if let Err(error) = publishers.publish(messages) {
                        tracing::warn!(camera, capture_id, %error, "a message is lost to readers outside this process");
                    }
                }
            };
            // A panic would have been reported by the runtime; the next capture is published anyway.
            let _ = tokio::task::spawn_blocking(publish).await;
        }
    }
}
