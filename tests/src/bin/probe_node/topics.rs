//! What the probe publishes, echoes and watches.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use ros::{Node, Publisher, Qos, Subscription};
use scenarios::patterns;
use tokio::time::{MissedTickBehavior, interval};

use crate::Options;

const READER_PATIENCE: Duration = Duration::from_mins(1);

/// What the services see and change of the publishing.
pub(crate) struct Publishing {
    pub(crate) enabled: AtomicBool,
    pub(crate) published: AtomicU64,
}

impl Publishing {
    pub(crate) fn new(options: &Options) -> Self {
        Self {
            enabled: AtomicBool::new(!options.mute),
            published: AtomicU64::new(0),
        }
    }
}

pub(crate) struct Topics {
    images: Publisher<Image>,
    maps: Publisher<Image>,
    infos: Publisher<CameraInfo>,
    echo_in: Subscription<Image>,
    echo_out: Publisher<Image>,
    watched: Option<Subscription<Image>>,
}

impl Topics {
    pub(crate) fn new(node: &Node, options: &Options) -> Result<Self, ros::Error> {
        let watched = || node.subscription("c1/normals", Qos::MAP);
        Ok(Self {
            images: node.publisher("c1/image_raw", Qos::IMAGE)?,
            maps: node.publisher("c1/normals", Qos::MAP)?,
            infos: node.publisher("c1/camera_info", Qos::LATCHED)?,
            echo_in: node.subscription("echo/in", Qos::IMAGE)?,
            echo_out: node.publisher("echo/out", Qos::IMAGE)?,
            watched: options.watch.then(watched).transpose()?,
        })
    }

    pub(crate) async fn serve(self, node: &Node, options: &Options, publishing: &Publishing) -> anyhow::Result<()> {
        let Self {
            images,
            maps,
            infos,
            echo_in,
            echo_out,
            watched,
        } = self;
        infos.publish(patterns::camera_info(options.image_size, node.clock().now()))?;
        tokio::try_join!(
            publish(node, options, publishing, &images, &maps),
            echo(echo_in, &echo_out),
            watch(node, watched),
        )?;
        Ok(())
    }
}

async fn publish(
    node: &Node,
    options: &Options,
    publishing: &Publishing,
    images: &Publisher<Image>,
    maps: &Publisher<Image>,
) -> anyhow::Result<()> {
    if options.wait_for_readers > 0 {
        maps.wait_for_subscriptions(options.wait_for_readers, READER_PATIENCE)
            .await?;
    }
    let map = patterns::normal_map(options.map_size, node.clock().now());
    let mut ticks = interval(Duration::from_secs_f64(1.0 / options.rate));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        let published = publishing.published.load(Ordering::Relaxed);
        let done = options.count > 0 && published >= options.count;
        if done || !publishing.enabled.load(Ordering::Relaxed) {
            continue;
        }
        let stamp = node.clock().now();
        images.publish(patterns::image(options.image_size, published as u16, stamp))?;
        // Clones share the pixels.
        let mut map = map.clone();
        map.header.stamp = stamp;
        maps.publish(map)?;
        publishing.published.fetch_add(1, Ordering::Relaxed);
    }
}

async fn echo(mut incoming: Subscription<Image>, outgoing: &Publisher<Image>) -> anyhow::Result<()> {
    while let Some(received) = incoming.next().await {
        outgoing.publish(received.message)?;
    }
    Ok(())
}

async fn watch(node: &Node, watched: Option<Subscription<Image>>) -> anyhow::Result<()> {
    let Some(mut maps) = watched else { return Ok(()) };
    let mut expected = Arc::new(patterns::normal_map(1, node.clock().now()));
    while let Some(received) = maps.next().await {
        let map = received.message;
        if expected.width != map.width {
            expected = Arc::new(patterns::normal_map(map.width, map.header.stamp));
        }
        let age_ms = (node.clock().now_nanos() - map.header.stamp.to_nanos()) / 1_000_000;
        let verdict = if map.data == expected.data {
            "map"
        } else {
            "damaged map"
        };
        println!("{verdict} {} {age_ms}", map.width);
    }
    Ok(())
}
