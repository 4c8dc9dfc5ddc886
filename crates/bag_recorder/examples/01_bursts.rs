//! Sends captures of two cameras (16 images, 75 MB) at a recorder and prints what it costs the sender, what is dropped,
//! and when it is on the disk: with nodes of one process, which share the images, and by DDS from another process.
//!
//! ```text
//! cargo run --release -p bag_recorder --example 01_bursts -- [CAPTURES] [PERIOD_SECONDS]
//! ```

use std::process::Stdio;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::srv::{StartRecording, StartRecordingRequest};
use interfaces::sensor_msgs::msg::Image;
use interfaces::std_srvs::srv::{Trigger, TriggerRequest};
use ros::{DiscoveryRange, Node, NodeOptions, Publisher, Qos, ServiceClient};

const SIZE: u32 = 1536;
const STEPS: usize = 8;
const STEP: Duration = Duration::from_millis(12);
const TIMEOUT: Duration = Duration::from_secs(30);
/// Domains that no other program here is likely to use.
const DOMAIN: u16 = 97;

#[tokio::main(flavor = "multi_thread")]
async fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1).peekable();
    if arguments.next_if(|argument| argument == "--recorder").is_some() {
        return record_until_stdin_ends(&arguments.next().context("a folder")?).await;
    }
    let captures = arguments.next().map_or(Ok(10), |text| text.parse())?;
    let period = Duration::from_secs_f64(arguments.next().map_or(Ok(1.0), |text| text.parse())?);
    let images: Vec<Arc<Image>> = (0..2 * STEPS as u64).map(|seed| Arc::new(image(seed))).collect();
    let bench = Bench::new(&images, captures, period).await?;
    println!("nobody listens    {}", bench.send().await?);

    let folder = tempfile::tempdir()?;
    let recorder = start_recorder(folder.path().to_str().context("a path")?).await?;
    println!("same process      {}", bench.record().await?);
    recorder.shutdown().await;

    let mut child = tokio::process::Command::new(std::env::current_exe()?)
        .arg("--recorder")
        .arg(folder.path())
        .stdin(Stdio::piped())
        .spawn()?;
    println!("another process   {}", bench.record().await?);
    drop(child.stdin.take());
    anyhow::ensure!(child.wait().await?.success(), "the recorder failed");
    Ok(())
}

struct Bench<'a> {
    images: &'a [Arc<Image>],
    captures: usize,
    period: Duration,
    cameras: [Publisher<Image>; 2],
    starts: ServiceClient<StartRecording>,
    stops: ServiceClient<Trigger>,
    /// A node leaves the graph when nobody holds it.
    _node: Node,
}

impl<'a> Bench<'a> {
    async fn new(images: &'a [Arc<Image>], captures: usize, period: Duration) -> anyhow::Result<Self> {
        let node = Node::start(options("cameras")).await?;
        Ok(Self {
            images,
            captures,
            period,
            cameras: [
                node.publisher("c1/image_raw", Qos::IMAGE)?,
                node.publisher("c2/image_raw", Qos::IMAGE)?,
            ],
            starts: node.service_client("record/start")?,
            stops: node.service_client("record/stop")?,
            _node: node,
        })
    }

    /// Publishes as cameras do, an image each per step; how long a capture takes then, and how long the calls.
    async fn send(&self) -> anyhow::Result<String> {
        let (mut captures, mut calls) = (Vec::new(), Vec::new());
        let mut next = tokio::time::Instant::now();
        for _ in 0..self.captures {
            let began = Instant::now();
            let mut step = tokio::time::Instant::now();
            for pair in self.images.chunks_exact(2) {
                step += STEP;
                tokio::time::sleep_until(step).await;
                for (camera, image) in self.cameras.iter().zip(pair) {
                    let called = Instant::now();
                    tokio::task::block_in_place(|| camera.publish(Arc::clone(image)))?;
                    calls.push(called.elapsed());
                }
            }
            captures.push(began.elapsed());
            next += self.period;
            tokio::time::sleep_until(next).await;
        }
        Ok(format!(
            "capture {}, publish call {}",
            quantiles(captures),
            quantiles(calls)
        ))
    }

    async fn record(&self) -> anyhow::Result<String> {
        let started = self.starts.call(StartRecordingRequest::default(), TIMEOUT).await?;
        anyhow::ensure!(started.success, "{}", started.message);
        // The images have no latched topic beside them here.
        for camera in &self.cameras {
            camera.wait_for_subscriptions(1, TIMEOUT).await?;
        }
        let sent = self.send().await?;
        let asked = Instant::now();
        let stopped = self.stops.call(TriggerRequest::default(), TIMEOUT).await?;
        let on_disk = asked.elapsed().as_millis();
        Ok(format!(
            "{sent}, on disk {on_disk} ms after the stop\n                  {}",
            stopped.message
        ))
    }
}

fn quantiles(mut times: Vec<Duration>) -> String {
    times.sort_unstable();
    let at = |part: f64| times[((times.len() - 1) as f64 * part).round() as usize].as_secs_f64() * 1e3;
    format!("{:.2} ms (p99 {:.2})", at(0.5), at(0.99))
}

fn options(name: &str) -> NodeOptions {
    let options = NodeOptions::new(name).namespace("/cell").domain_id(DOMAIN);
    options.discovery_range(DiscoveryRange::Localhost)
}

async fn start_recorder(folder: &str) -> anyhow::Result<Node> {
    let node = Node::start(options("bag_recorder").parameter("folder", folder)).await?;
    tokio::spawn(bag_recorder::run(node.clone()));
    Ok(node)
}

async fn record_until_stdin_ends(folder: &str) -> anyhow::Result<()> {
    let node = start_recorder(folder).await?;
    tokio::task::spawn_blocking(|| std::io::stdin().read_line(&mut String::new())).await??;
    node.shutdown().await;
    Ok(())
}

/// A lit object on a mat as a 12-bit sensor of 10,500 electrons sees it, in steps of 16.
fn image(seed: u64) -> Image {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut data = Vec::with_capacity(2 * (SIZE * SIZE) as usize);
    for index in 0..SIZE * SIZE {
        let centred = |position: u32| f64::from(position) / f64::from(SIZE) - 0.5;
        let (x, y) = (centred(index % SIZE), centred(index / SIZE));
        let lit = 400.0 + 2000.0 * (1.0 - 4.0 * (x * x + y * y)).max(0.0) * (1.0 + x);
        let electrons_per_step = 10_500.0 / 4095.0;
        let sigma = (lit / electrons_per_step + 64.0 / (electrons_per_step * electrons_per_step)).sqrt();
        // Near enough to a normal distribution.
        let noise = (0..4).map(|_| random.f64() - 0.5).sum::<f64>() * 3.0_f64.sqrt();
        data.extend((((lit + sigma * noise).clamp(0.0, 4095.0) as u16) << 4).to_le_bytes());
    }
    let mut image = Image {
        width: SIZE,
        height: SIZE,
        step: 2 * SIZE,
        encoding: "mono16".into(),
        data: data.into(),
        ..Image::default()
    };
    image.header.stamp = Time {
        sec: seed as i32,
        nanosec: 0,
    };
    image
}
