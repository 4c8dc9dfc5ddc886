//! One end of a measurement: the Rust counterpart of `tests/rclpy/transport_peer.py`.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use clap::Args;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::sensor_msgs::msg::Image;
use interfaces::std_msgs::msg::Header;
use ros::{Node, NodeOptions, Qos};

/// Depth 2, as the rclpy peer.
const QOS: Qos = Qos::reliable(2);

/// What a peer sends or receives.
#[derive(Args, Clone)]
pub(crate) struct Task {
    /// Topic.
    pub(crate) topic: String,
    /// Bytes of pixel data in a message.
    pub(crate) bytes: usize,
    /// Messages.
    pub(crate) count: usize,
    /// Seconds between two messages.
    pub(crate) interval: f64,
    /// Seconds after which a peer gives up.
    pub(crate) timeout: f64,
}

pub(crate) async fn publish(task: &Task) -> anyhow::Result<()> {
    let node = Node::start(NodeOptions::new("transport_publish")).await?;
    let publisher = node.publisher::<Image>(&task.topic, QOS)?;
    let patience = Duration::from_secs_f64(task.timeout);
    publisher.wait_for_subscriptions(1, patience).await?;
    tokio::time::sleep(Duration::from_secs(1)).await; // both directions of the match, as the rclpy peer
    let pixels = interfaces::ByteSequence::from(vec![0_u8; task.bytes]);
    let mut sent = 0;
    for _ in 0..task.count {
        let next = tokio::time::Instant::now() + Duration::from_secs_f64(task.interval);
        publisher.publish(image(pixels.clone()))?;
        sent += 1;
        tokio::time::sleep_until(next).await;
    }
    // Stay until the reader has gone: what it still misses is repaired.
    let deadline = Instant::now() + patience;
    while publisher.subscription_count() > 0 && Instant::now() < deadline {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    println!("{}", serde_json::json!({ "sent": sent }));
    node.shutdown().await;
    Ok(())
}

pub(crate) async fn subscribe(task: &Task) -> anyhow::Result<()> {
    let node = Node::start(NodeOptions::new("transport_subscribe")).await?;
    let mut subscription = node.subscription::<Image>(&task.topic, QOS)?;
    let deadline = tokio::time::Instant::now() + Duration::from_secs_f64(task.timeout);
    let mut latencies_ms = Vec::new();
    while latencies_ms.len() < task.count {
        let Ok(Some(received)) = tokio::time::timeout_at(deadline, subscription.next()).await else {
            break;
        };
        if received.message.data.len() == task.bytes {
            latencies_ms.push(age_ms(&received.message));
        }
    }
    println!("{}", serde_json::json!({ "latencies_ms": latencies_ms }));
    drop(subscription);
    node.shutdown().await;
    Ok(())
}

/// A node that only exists.
pub(crate) async fn idle(duration: Duration) -> anyhow::Result<()> {
    let node = Node::start(NodeOptions::new("transport_idle")).await?;
    let _subscription = node.subscription::<Image>("idle", QOS)?;
    tokio::time::sleep(duration).await;
    node.shutdown().await;
    Ok(())
}

/// An image in one row, stamped now.
pub(crate) fn image(data: interfaces::ByteSequence) -> Image {
    let width = u32::try_from(data.len()).expect("images of the benchmark are below 4 GiB");
    let now = now();
    let stamp = Time {
        sec: now.as_secs() as i32,
        nanosec: now.subsec_nanos(),
    };
    let header = Header {
        stamp,
        frame_id: String::new(),
    };
    Image {
        header,
        height: 1,
        width,
        encoding: "mono8".into(),
        is_bigendian: 0,
        step: width,
        data,
    }
}

/// Milliseconds since the image was stamped.
pub(crate) fn age_ms(image: &Image) -> f64 {
    let stamp = &image.header.stamp;
    let stamped = Duration::new(u64::from(stamp.sec.unsigned_abs()), stamp.nanosec);
    (now().as_secs_f64() - stamped.as_secs_f64()) * 1e3
}

fn now() -> Duration {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .expect("the system clock is after 1970")
}
