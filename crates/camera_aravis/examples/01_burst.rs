//! Measures what a capture waits for: eight frames of 1536 x 1536 pixels from each of two cameras, triggered together.
//!
//! ```text
//! cargo run --release -p camera_aravis --example 01_burst -- [KEY=VALUE...]
//! ```
//!
//! Keys: `path` (udp or packet), `rounds`, `period_us` between triggers, `size` and `delay_us` of packets, `buffer`
//! of the UDP socket in bytes, `patience_us` and `resend_us` of the receiver. It serves the cameras itself, on loopback.

use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use bytes::Bytes;
use camera_aravis::{AravisCamera, CameraConfig};
use devices::{Binning, Camera, CameraLink, CameraSettings, FrameEvent, Frames, TriggerMode};
use gige_vision::{DeviceConfig, FrameRequest, Server};

const FRAMES: usize = 8;
/// A burst that takes longer has lost a frame without a trace.
const PATIENCE: Duration = Duration::from_secs(3);

struct Options(BTreeMap<String, String>);

impl Options {
    fn read() -> anyhow::Result<Self> {
        let pairs = std::env::args().skip(1).map(|argument| {
            let (key, value) = argument
                .split_once('=')
                .with_context(|| format!("{argument:?} is no KEY=VALUE"))?;
            Ok((key.to_owned(), value.to_owned()))
        });
        pairs.collect::<anyhow::Result<_>>().map(Self)
    }

    fn number(&self, key: &str) -> anyhow::Result<Option<u32>> {
        let parse = |value: &String| value.parse().with_context(|| format!("{key} = {value:?} is no number"));
        self.0.get(key).map(parse).transpose()
    }

    fn micros(&self, key: &str) -> anyhow::Result<Option<Duration>> {
        Ok(self.number(key)?.map(|micros| Duration::from_micros(u64::from(micros))))
    }

    fn camera(&self, ip: Ipv4Addr) -> anyhow::Result<CameraConfig> {
        let defaults = CameraConfig::new(ip.to_string());
        let packet_socket = match self.0.get("path").map(String::as_str) {
            Some("udp") => false,
            Some("packet") | None => true,
            Some(other) => bail!("path = {other:?}; allowed: udp, packet"),
        };
        let config = CameraConfig {
            packet_socket,
            packet_size: self.number("size")?.unwrap_or(defaults.packet_size),
            packet_delay: self.micros("delay_us")?.unwrap_or(defaults.packet_delay),
            socket_buffer: self.number("buffer")?,
            packet_patience: self.micros("patience_us")?.unwrap_or(defaults.packet_patience),
            resend_patience: self.micros("resend_us")?.unwrap_or(defaults.resend_patience),
            ..defaults
        };
        config.check()?;
        Ok(config)
    }
}

struct Pair {
    servers: Vec<Server>,
    cameras: Vec<AravisCamera>,
}

impl Pair {
    async fn open(options: &Options) -> anyhow::Result<Self> {
        let images: Vec<Bytes> = (0..FRAMES)
            .map(|index| vec![index as u8 * 30; 1536 * 1536 * 2].into())
            .collect();
        let (mut servers, mut cameras) = (Vec::new(), Vec::new());
        for last in 1..=2 {
            let ip = Ipv4Addr::new(127, 200, std::process::id() as u8, last);
            let images = images.clone();
            let source = move |request: &FrameRequest| images[request.index as usize % FRAMES].clone();
            servers.push(Server::start(&DeviceConfig::new(format!("B{last}"), ip), source)?);
            let camera = AravisCamera::open(options.camera(ip)?);
            let is_open = |link: &CameraLink| matches!(link, CameraLink::Open { .. });
            tokio::time::timeout(PATIENCE, camera.link().wait_for(is_open)).await??;
            for time in ["first", "second"] {
                let started = Instant::now();
                camera.configure(settings()).await?;
                println!("configured for the {time} time in {:.1} ms", millis(started.elapsed()));
            }
            cameras.push(camera);
        }
        Ok(Self { servers, cameras })
    }

    /// Time from the first trigger to the last frame, and frames that were whole.
    async fn burst(&self, period: Duration) -> anyhow::Result<(Duration, usize)> {
        let mut armed = Vec::new();
        for camera in &self.cameras {
            armed.push(camera.arm(FRAMES).await?);
        }
        let start = Instant::now();
        for step in 0..FRAMES as u32 {
            for server in &self.servers {
                server.line_trigger(start + step * period);
            }
        }
        let mut whole = 0;
        for frames in &mut armed {
            whole += receive(frames).await;
        }
        Ok((start.elapsed(), whole))
    }
}

fn settings() -> CameraSettings {
    CameraSettings {
        region: None,
        binning: Binning {
            horizontal: 1,
            vertical: 1,
        },
        exposure: Duration::from_micros(2500),
        gain_db: 0.0,
        black_level: 0.0,
        trigger: TriggerMode::Line,
    }
}

async fn receive(frames: &mut Frames) -> usize {
    let mut whole = 0;
    while let Ok(Some(event)) = tokio::time::timeout(PATIENCE, frames.recv()).await {
        match event {
            FrameEvent::Frame(_) => whole += 1,
            FrameEvent::Fault(fault) => println!("{fault}"),
        }
    }
    whole
}

fn millis(time: Duration) -> f64 {
    time.as_secs_f64() * 1000.0
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> anyhow::Result<()> {
    let options = Options::read()?;
    let rounds = options.number("rounds")?.unwrap_or(30) as usize;
    let period = options.micros("period_us")?.unwrap_or(Duration::from_micros(3500));
    let pair = Pair::open(&options).await?;
    let (mut times, mut whole) = (Vec::new(), 0);
    for _ in 0..rounds {
        let (time, frames) = pair.burst(period).await?;
        times.push(millis(time));
        whole += frames;
    }
    println!("first {:.1} ms", times[0]);
    times.sort_by(f64::total_cmp);
    let expected = rounds * FRAMES * pair.cameras.len();
    let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize];
    println!(
        "{whole} of {expected} frames; median {:.1} ms, p90 {:.1}, most {:.1}",
        at(0.5),
        at(0.9),
        at(1.0)
    );
    // The statistics are refreshed once a second.
    let mut link = pair.cameras[0].link();
    link.mark_unchanged();
    tokio::time::timeout(PATIENCE, link.changed()).await.ok();
    if let CameraLink::Open { statistics, .. } = &*link.borrow() {
        let told: Vec<String> = statistics
            .iter()
            .map(|(name, value)| format!("{name} {value}"))
            .collect();
        println!("{}", told.join(", "));
    }
    Ok(())
}
