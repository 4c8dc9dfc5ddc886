//! Publishing images, in order, without keeping anybody waiting.
//!
//! Subscriptions of this process get a capture at once. Sending it out of the process blocks while a reliable reader
//! there is slow, so every camera has a queue and a task of its own for that. The queue holds a few captures; when
//! readers are slower than that, the oldest capture that waits is not sent, with a warning. Sending takes processor time,
//! so it begins when the caller of `capture` has its answer.

use std::collections::VecDeque;
use std::sync::Arc;

use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use parking_lot::Mutex;
use ros::{Node, Publisher, Qos};
use tokio::sync::{Notify, watch};

use crate::convert::ExposureMessages;
use crate::record::CameraRecord;

/// Captures that wait for slow readers, beside the one that is being published.
const QUEUE: usize = 2;

/// One camera's share of a capture.
pub(crate) struct Job {
    pub(crate) capture_id: String,
    pub(crate) messages: Vec<ExposureMessages>,
    pub(crate) answered: Answered,
}

/// Whether the caller has its answer: the sender of this channel is gone then, whatever became of the answer.
pub(crate) type Answered = watch::Receiver<()>;

/// One camera's captures on their way out. Clones are handles to the same queue.
#[derive(Clone)]
pub(crate) struct PublishQueue {
    camera: String,
    record: CameraRecord,
    inner: Arc<Inner>,
}

struct Inner {
    publishers: Publishers,
    jobs: Mutex<VecDeque<Job>>,
    arrived: Notify,
}

/// One camera's topics.
struct Publishers {
    exposures: Publisher<Exposure>,
    infos: Publisher<CameraInfo>,
    images: Publisher<Image>,
}

impl Publishers {
    fn new(node: &Node, camera: &str) -> Result<Self, ros::Error> {
        Ok(Self {
            exposures: node.publisher(&format!("{camera}/exposure"), Qos::STREAM)?,
            infos: node.publisher(&format!("{camera}/camera_info"), Qos::LATCHED)?,
            images: node.publisher(&format!("{camera}/image_raw"), Qos::IMAGE)?,
        })
    }

    /// Exposure and camera first: who gets the image then has all that it needs.
    fn hand_over(&self, messages: &ExposureMessages) {
        self.exposures.hand_over(&messages.exposure);
        self.infos.hand_over(&messages.info);
        self.images.hand_over(&messages.image);
    }

    /// In the same order. A topic whose readers are stuck does not hold the others up for longer than its time-out.
    fn send(&self, messages: ExposureMessages) -> Result<(), ros::Error> {
        let sent = [
            self.exposures.send(messages.exposure),
            self.infos.send(messages.info),
            self.images.send(messages.image),
        ];
        sent.into_iter().collect()
    }
}

impl PublishQueue {
    pub(crate) fn new(node: &Node, camera: &str, record: CameraRecord) -> Result<Self, ros::Error> {
        let inner = Inner {
            publishers: Publishers::new(node, camera)?,
            jobs: Mutex::default(),
            arrived: Notify::new(),
        };
        Ok(Self {
            camera: camera.to_owned(),
            record,
            inner: Arc::new(inner),
        })
    }

    /// Publishes a capture: in this process now, outside soon.
    pub(crate) fn push(&self, job: Job) {
        job.messages
            .iter()
            .for_each(|messages| self.inner.publishers.hand_over(messages));
        let mut jobs = self.inner.jobs.lock();
        jobs.push_back(job);
        let given_up = if jobs.len() > QUEUE { jobs.pop_front() } else { None };
        drop(jobs);
        self.inner.arrived.notify_one();
        if let Some(job) = given_up {
            self.record.unsent();
            tracing::warn!(
                camera = self.camera,
                capture_id = job.capture_id,
                images = job.messages.len(),
                "not sent out of this process: readers of the captures before are too slow"
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

    /// Sends until the caller ends this task; the image that is on its way then is the last.
    pub(crate) async fn run(self) {
        // What blocks cannot be cancelled, but it can look whether anybody still waits for it.
        let running = Arc::new(());
        loop {
            let mut job = self.next().await;
            while job.answered.changed().await.is_ok() {}
            let (queue, running) = (self.clone(), Arc::downgrade(&running));
            let send = move || {
                let Job {
                    capture_id, messages, ..
                } = job;
                for messages in messages.into_iter().take_while(|_| running.strong_count() > 0) {
                    if let Err(error) = queue.inner.publishers.send(messages) {
                        let camera = &queue.camera;
                        tracing::warn!(camera, capture_id, %error, "a message is lost to readers outside this process");
                    }
                }
            };
            // A panic would have been reported by the runtime; the next capture is sent anyway.
            let _ = tokio::task::spawn_blocking(send).await;
        }
    }
}
