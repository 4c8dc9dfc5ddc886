//! Captures, as an operator's script asks for them.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use interfaces::rakelight_msgs::srv::{Capture, CaptureRequest, StartRecording, StartRecordingRequest};
use interfaces::std_srvs::srv::{Trigger, TriggerRequest};
use ros::{Node, ServiceClient};
use scenarios::{Domain, quantile};

use crate::report::Recording;

/// Longer than any capture, its repetition and the cell's start.
const PATIENCE: Duration = Duration::from_mins(1);

/// Images that a capture has: dark and seven panels, of two cameras.
pub(crate) const IMAGES: usize = 16;

pub(crate) struct Operator {
    node: Node,
    capture: ServiceClient<Capture>,
}

/// What came of a number of captures.
#[derive(Default)]
pub(crate) struct Captures {
    /// Milliseconds from the call to the answer, of those that succeeded.
    pub(crate) millis: Vec<f64>,
    /// Captures asked for.
    pub(crate) asked: usize,
    /// Images of those that succeeded.
    pub(crate) images: usize,
    /// Sequences that were void, whether or not their repetition succeeded.
    pub(crate) void: usize,
    /// Why, as far as the service said.
    pub(crate) reasons: Vec<String>,
}

impl Operator {
    pub(crate) async fn start(domain: &Domain) -> anyhow::Result<Self> {
        let node = domain.node("operator").await;
        let capture = node.service_client::<Capture>("capture")?;
        capture.wait_for_server(PATIENCE).await?;
        let operator = Self { node, capture };
        operator.warm_up().await?;
        Ok(operator)
    }

    pub(crate) async fn stop(self) {
        self.node.shutdown().await;
    }

    /// Cameras and lights take seconds to be found, and the first images have to be rendered.
    async fn warm_up(&self) -> anyhow::Result<()> {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let answer = self.call().await?.1;
            if answer.success {
                return Ok(());
            }
            if Instant::now() > deadline {
                bail!("no capture succeeded within {PATIENCE:?}: {}", answer.message);
            }
            tokio::time::sleep(Duration::from_millis(200)).await;
        }
    }

    async fn call(&self) -> anyhow::Result<(f64, std::sync::Arc<interfaces::rakelight_msgs::srv::CaptureResponse>)> {
        let started = Instant::now();
        let answer = self.capture.call(CaptureRequest::default(), PATIENCE).await?;
        Ok((started.elapsed().as_secs_f64() * 1e3, answer))
    }

    pub(crate) async fn captures(&self, count: usize, pause: Duration) -> anyhow::Result<Captures> {
        let mut captures = Captures::default();
        for _ in 0..count {
            let (millis, answer) = self.call().await?;
            captures.asked += 1;
            captures.void += usize::from(answer.repeats);
            if answer.success {
                captures.millis.push(millis);
                captures.images += IMAGES / 8 * usize::from(answer.count);
            } else {
                captures.void += 1;
                captures.reasons.push(answer.message.clone());
            }
            tokio::time::sleep(pause).await;
        }
        Ok(captures)
    }

    /// Captures in turn with and without a recording, so that a slow machine slows both.
    pub(crate) async fn compare_recording(
        &self,
        count: usize,
        pause: Duration,
        folder: &Path,
    ) -> anyhow::Result<Recording> {
        const BLOCK: usize = 5;
        let start = self.node.service_client::<StartRecording>("record/start")?;
        let stop = self.node.service_client::<Trigger>("record/stop")?;
        let (mut with, mut without) = (Captures::default(), Captures::default());
        for block in 0..count.div_ceil(BLOCK) {
            without.extend(self.captures(BLOCK, pause).await?);
            let path = folder.join(format!("recorded_{block}")).display().to_string();
            let request = StartRecordingRequest {
                path,
                ..Default::default()
            };
            let answer = start.call(request, PATIENCE).await?;
            if !answer.success {
                bail!("the recording did not start: {}", answer.message);
            }
            with.extend(self.captures(BLOCK, pause).await?);
            let answer = stop.call(TriggerRequest::default(), PATIENCE).await?;
            if !answer.success {
                bail!("the recording did not end well: {}", answer.message);
            }
        }
        let blocks = (0..count.div_ceil(BLOCK)).map(|block| folder.join(format!("recorded_{block}")));
        let recorded = blocks.map(|bag| images_in(&bag)).sum::<anyhow::Result<usize>>()?;
        let median = |captures: &Captures| quantile(&captures.millis, 0.5).context("no capture succeeded");
        Ok(Recording {
            with_ms: median(&with)?,
            without_ms: median(&without)?,
            images_expected: with.images,
            images_recorded: recorded,
        })
    }
}

impl Captures {
    fn extend(&mut self, other: Self) {
        self.millis.extend(other.millis);
        self.asked += other.asked;
        self.images += other.images;
        self.void += other.void;
        self.reasons.extend(other.reasons);
    }
}

fn images_in(bag: &Path) -> anyhow::Result<usize> {
    let bag = recording::Bag::open(bag)?;
    let images = bag.topics().iter().filter(|topic| topic.name.ends_with("/image_raw"));
    Ok(images.map(|topic| topic.message_count as usize).sum())
}
