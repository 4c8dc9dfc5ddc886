//! Runs every measurement.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use interfaces::sensor_msgs::msg::Image;
use ros::Qos;
use scenarios::{Domain, quantile, resources};
use serde::Deserialize;
use tokio::process::{Child, Command};

use crate::peer::image;
use crate::report::{Pair, Report};

/// A 1536 x 1536 mono16 image, and a 1536 x 1536 map of three floats.
pub(crate) const SIZES: [usize; 2] = [1536 * 1536 * 2, 1536 * 1536 * 12];

/// The kernel's default socket buffer; Rust's sockets ask for no more than rclpy's get, whatever this machine allows.
const KERNEL_DEFAULT_BUFFER: &str = "212992";

const PEER_TIMEOUT: Duration = Duration::from_mins(2);

/// Who is at an end of a pairing.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Rust,
    Rclpy,
}

impl End {
    fn name(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::Rclpy => "rclpy",
        }
    }
}

pub(crate) async fn everything(count: usize, memory_seconds: u64, python: Option<&Path>) -> anyhow::Result<Report> {
    let mut left_out = Vec::new();
    let mut pairs = Vec::new();
    for bytes in SIZES {
        for (from, to) in [
            (End::Rust, End::Rclpy),
            (End::Rclpy, End::Rust),
            (End::Rust, End::Rust),
            (End::Rclpy, End::Rclpy),
        ] {
            if python.is_none() && (from == End::Rclpy || to == End::Rclpy) {
                left_out.push(format!(
                    "{} to {}, {bytes} bytes: no Python with rclpy; `cargo xtask setup` makes one",
                    from.name(),
                    to.name()
                ));
                continue;
            }
            eprintln!("{} to {}, {bytes} bytes ...", from.name(), to.name());
            pairs.push(pair(from, to, bytes, count, python).await?);
        }
    }
    let mut handover_us = f64::NAN;
    let mut handover_shares_memory = true;
    for bytes in SIZES {
        let handed_over = handover(bytes, count).await?;
        handover_us = quantile(&handed_over.micros, 0.5).unwrap_or(f64::NAN);
        handover_shares_memory &= handed_over.shared;
        pairs.push(in_process_pair(bytes, count, &handed_over.micros));
    }
    eprintln!("memory of a publisher, {memory_seconds} s ...");
    let rss_mb = publisher_memory(memory_seconds).await?;
    eprintln!("an idle node ...");
    let idle_cpu_percent = idle_cpu().await?;
    Ok(Report {
        pairs,
        serialize_28mb_ms: serialising()?,
        handover_us,
        handover_shares_memory,
        rss_mb,
        idle_cpu_percent,
        left_out,
        kernel: resources::kernel_buffers(),
    })
}

fn in_process_pair(bytes: usize, sent: usize, micros: &[f64]) -> Pair {
    let ms = |share| quantile(micros, share).map(|micros| micros / 1e3);
    Pair {
        from: "rust".into(),
        to: "same process".into(),
        bytes,
        sent,
        delivered: micros.len(),
        median_ms: ms(0.5),
        p99_ms: ms(0.99),
    }
}

async fn pair(from: End, to: End, bytes: usize, count: usize, python: Option<&Path>) -> anyhow::Result<Pair> {
    #[derive(Deserialize)]
    struct Sent {
        sent: usize,
    }
    #[derive(Deserialize)]
    struct Latencies {
        latencies_ms: Vec<f64>,
    }
    let domain = Domain::claim();
    // Slow enough that a message is through before the next one starts.
    let interval = if bytes > 10_000_000 { 1.0 } else { 0.25 };
    let subscriber = start(to, "subscribe", &domain, bytes, count, interval, python)?;
    let publisher = start(from, "publish", &domain, bytes, count, interval, python)?;
    let sent: Sent = last_line(publisher, "publisher").await?;
    let received: Latencies = last_line(subscriber, "subscriber").await?;
    Ok(Pair {
        from: from.name().into(),
        to: to.name().into(),
        bytes,
        sent: sent.sent,
        delivered: received.latencies_ms.len(),
        median_ms: quantile(&received.latencies_ms, 0.5),
        p99_ms: quantile(&received.latencies_ms, 0.99),
    })
}

fn start(
    end: End,
    role: &str,
    domain: &Domain,
    bytes: usize,
    count: usize,
    interval: f64,
    python: Option<&Path>,
) -> anyhow::Result<Child> {
    let mut command = match end {
        End::Rust => Command::new(std::env::current_exe()?),
        End::Rclpy => {
            let mut command = Command::new(python.context("no Python with rclpy")?);
            command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("rclpy/transport_peer.py"));
            command
        }
    };
    let timeout = PEER_TIMEOUT.as_secs_f64();
    command.arg(role).arg("/transport").args([
        bytes.to_string(),
        count.to_string(),
        interval.to_string(),
        timeout.to_string(),
    ]);
    command
        .envs(domain.environment())
        .env("RAKELIGHT_SOCKET_BUFFER_BYTES", KERNEL_DEFAULT_BUFFER);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).kill_on_drop(true);
    command.spawn().with_context(|| format!("cannot start {command:?}"))
}

/// The JSON that a peer prints last.
async fn last_line<T: for<'de> Deserialize<'de>>(child: Child, what: &str) -> anyhow::Result<T> {
    let output = tokio::time::timeout(PEER_TIMEOUT + Duration::from_secs(30), child.wait_with_output())
        .await
        .with_context(|| format!("the {what} did not end"))??;
    let text = String::from_utf8_lossy(&output.stdout);
    let Some(line) = text.lines().last().filter(|_| output.status.success()) else {
        bail!("the {what} failed: {}", output.status);
    };
    serde_json::from_str(line).with_context(|| format!("the {what} printed {line:?}"))
}

/// Times from `publish` to the subscriber of the same process, and whether it always got the publisher's own memory.
struct HandedOver {
    micros: Vec<f64>,
    shared: bool,
}

async fn handover(bytes: usize, count: usize) -> anyhow::Result<HandedOver> {
    let domain = Domain::claim();
    let (sender, receiver) = (domain.node("sender").await, domain.node("receiver").await);
    let publisher = sender.publisher::<Image>("/transport", Qos::MAP)?;
    let mut subscription = receiver.subscription::<Image>("/transport", Qos::MAP)?;
    let mut handed_over = HandedOver {
        micros: Vec::new(),
        shared: true,
    };
    for _ in 0..count {
        let message = Arc::new(image(vec![0_u8; bytes].into()));
        let start = Instant::now();
        publisher.publish(Arc::clone(&message))?;
        let received = subscription.next().await.context("the subscription ended")?;
        handed_over.micros.push(start.elapsed().as_secs_f64() * 1e6);
        handed_over.shared &= Arc::ptr_eq(&message, &received.message);
    }
    sender.shutdown().await;
    receiver.shutdown().await;
    Ok(handed_over)
}

fn serialising() -> anyhow::Result<f64> {
    let message = image(vec![0_u8; SIZES[1]].into());
    let mut times = Vec::new();
    for _ in 0..10 {
        let start = Instant::now();
        std::hint::black_box(interfaces::cdr::to_vec(&message)?);
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(quantile(&times, 0.5).unwrap_or(f64::NAN))
}

/// Highest resident memory of a process that publishes 28 MB maps at 1 Hz to a Rust subscriber.
async fn publisher_memory(seconds: u64) -> anyhow::Result<f64> {
    let domain = Domain::claim();
    let count = usize::try_from(seconds)?;
    let subscriber = start(End::Rust, "subscribe", &domain, SIZES[1], count, 1.0, None)?;
    let mut publisher = start(End::Rust, "publish", &domain, SIZES[1], count, 1.0, None)?;
    let pid = publisher.id().context("the publisher has ended")?;
    let mut highest: f64 = 0.0;
    let deadline = Instant::now() + Duration::from_secs(seconds) + PEER_TIMEOUT;
    while publisher.try_wait()?.is_none() && Instant::now() < deadline {
        highest = highest.max(resources::resident_mb(pid).unwrap_or(0.0));
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    drop(subscriber);
    Ok(highest)
}

/// Per cent of a core that a node uses while nothing happens, over ten seconds after it has settled.
async fn idle_cpu() -> anyhow::Result<f64> {
    const SETTLE: Duration = Duration::from_secs(3);
    const WATCH: Duration = Duration::from_secs(10);
    let domain = Domain::claim();
    let executable: PathBuf = std::env::current_exe()?;
    let mut command = Command::new(executable);
    command.args(["idle", "20"]).kill_on_drop(true);
    command.envs(domain.environment());
    let child = command.spawn()?;
    let pid = child.id().context("the idle node has ended")?;
    tokio::time::sleep(SETTLE).await;
    let before = resources::cpu_seconds(pid).context("the idle node has ended")?;
    tokio::time::sleep(WATCH).await;
    let after = resources::cpu_seconds(pid).context("the idle node has ended")?;
    Ok((after - before) / WATCH.as_secs_f64() * 100.0)
}
