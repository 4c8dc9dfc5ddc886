//! What readers get of captures.

use std::sync::{Arc, Mutex};

use interfaces::Message;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use ros::{Node, Qos, Subscription};
use scenarios::{TIMEOUT, eventually};

type Kept<M> = Arc<Mutex<Vec<Arc<M>>>>;

/// Everything that one camera published since this was made.
pub(crate) struct Reader {
    images: Kept<Image>,
    exposures: Kept<Exposure>,
    infos: Kept<CameraInfo>,
}

/// One image with what belongs to it.
pub(crate) struct Taken {
    pub(crate) image: Arc<Image>,
    pub(crate) exposure: Arc<Exposure>,
    pub(crate) info: Arc<CameraInfo>,
}

async fn keep<M: Message>(node: &Node, topic: String, qos: Qos) -> Kept<M> {
    let mut subscription: Subscription<M> = node.subscription(&topic, qos).expect("a subscription can be made");
    let published = subscription.wait_for_publishers(1, TIMEOUT).await;
    published.unwrap_or_else(|error| panic!("{topic}: {error}"));
    let kept = Kept::<M>::default();
    let list = Arc::clone(&kept);
    tokio::spawn(async move {
        while let Some(received) = subscription.next().await {
            list.lock().unwrap().push(received.message);
        }
    });
    kept
}

impl Reader {
    pub(crate) async fn new(node: &Node, camera: &str) -> Self {
        Self {
            images: keep(node, format!("{camera}/image_raw"), Qos::reliable(100)).await,
            exposures: keep(node, format!("{camera}/exposure"), Qos::STREAM).await,
            infos: keep(node, format!("{camera}/camera_info"), Qos::reliable(100)).await,
        }
    }

    /// All that came so far, once `count` images did: every image has its exposure and its camera, and no exposure or
    /// camera is without an image.
    pub(crate) async fn taken(&self, count: usize) -> Vec<Taken> {
        let enough = || {
            let lengths = [
                self.images.lock().unwrap().len(),
                self.exposures.lock().unwrap().len(),
                self.infos.lock().unwrap().len(),
            ];
            lengths.iter().all(|length| *length >= count)
        };
        eventually(&format!("{count} images"), enough).await;
        let (images, exposures, infos) = (
            self.images.lock().unwrap().clone(),
            self.exposures.lock().unwrap().clone(),
            self.infos.lock().unwrap().clone(),
        );
        assert_eq!([images.len(), exposures.len(), infos.len()], [count; 3]);
        let joined = images.into_iter().map(|image| {
            let exposure = exposures.iter().find(|exposure| exposure.header == image.header);
            let info = infos.iter().find(|info| info.header == image.header);
            Taken {
                exposure: Arc::clone(exposure.expect("every image has its exposure")),
                info: Arc::clone(info.expect("every image has its camera")),
                image,
            }
        });
        joined.collect()
    }

    /// How many images came so far.
    pub(crate) fn count(&self) -> usize {
        self.images.lock().unwrap().len()
    }
}

impl Taken {
    /// A pixel's value.
    pub(crate) fn pixel(&self, x: u32, y: u32) -> u16 {
        let at = (y * self.image.step + 2 * x) as usize;
        u16::from_le_bytes([self.image.data[at], self.image.data[at + 1]])
    }

    /// Brightness to the right and downwards of the middle, relative to that opposite.
    pub(crate) fn slopes(&self) -> [f64; 2] {
        let (width, height) = (self.image.width, self.image.height);
        let ratio = |a: u16, b: u16| (f64::from(a) / f64::from(b)).ln();
        [
            ratio(self.pixel(width - 1, height / 2), self.pixel(0, height / 2)),
            ratio(self.pixel(width / 2, height - 1), self.pixel(width / 2, 0)),
        ]
    }
}
