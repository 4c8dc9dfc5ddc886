//! One capture: cameras and lights together.

use std::time::{Duration, Instant};

use devices::{Channel, FrameEvent, Frames, TriggerMode};
use futures::future::{join_all, try_join_all};
use ros::Clock;

use crate::camera::{CaptureCamera, Settled, collect};
use crate::convert;
use crate::error::CaptureFailure;
use crate::join::{JoinedFrame, Sequence, Step, Take, TakeEnd, Void, join};
use crate::lights::{LightOrder, Lights};
use crate::parameters::{CaptureOptions, Parameters};

/// Software triggers are timed by this host, across a network.
const SOFTWARE_INTERVAL_TOLERANCE: Duration = Duration::from_millis(50);

/// Cameras and lights, in the hands of one caller at a time.
pub(crate) struct Session {
    pub(crate) cameras: Vec<CaptureCamera>,
    pub(crate) lights: Lights,
    pub(crate) parameters: Parameters,
    pub(crate) clock: Clock,
}

/// A capture that is whole.
pub(crate) struct Capture {
    pub(crate) id: String,
    pub(crate) repeats: u8,
    pub(crate) cameras: Vec<CameraCapture>,
}

/// One camera's share of it.
pub(crate) struct CameraCapture {
    /// Place in [`Session::cameras`].
    pub(crate) camera: usize,
    pub(crate) settled: Settled,
    pub(crate) frames: Vec<JoinedFrame>,
}

impl Capture {
    /// Stamp of the first image, nanoseconds.
    pub(crate) fn stamp(&self) -> i64 {
        let first = self.cameras.iter().filter_map(|camera| camera.frames.first());
        first.map(|frame| frame.stamp).min().unwrap_or_default()
    }
}

impl Session {
    /// Places of the named cameras, all when none is named.
    pub(crate) fn select(&self, names: &[String]) -> Result<Vec<usize>, CaptureFailure> {
        if names.is_empty() {
            return Ok((0..self.cameras.len()).collect());
        }
        let place = |name: &String| {
            let found = self.cameras.iter().position(|camera| camera.name == *name);
            found.ok_or_else(|| CaptureFailure::UnknownCamera {
                name: name.clone(),
                known: self
                    .cameras
                    .iter()
                    .map(|c| c.name.as_str())
                    .collect::<Vec<_>>()
                    .join(", "),
            })
        };
        let mut places = names.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        places.sort_unstable();
        places.dedup();
        Ok(places)
    }

    /// Takes a capture with these cameras. One that is void is repeated as often as the parameters say. When it fails
    /// the lights are off or about to go off by themselves, and no camera listens to its trigger.
    pub(crate) async fn capture(&mut self, cameras: &[usize]) -> Result<Capture, CaptureFailure> {
        let options = self.parameters.options();
        let mut repeats = 0;
        loop {
            let id = convert::capture_id(self.clock.now_nanos());
            match self.attempt(cameras, &id, &options).await {
                Ok(captures) => {
                    return Ok(Capture {
                        id,
                        repeats,
                        cameras: captures,
                    });
                }
                Err(CaptureFailure::Void(void)) if repeats < options.repeats => {
                    tracing::warn!(capture_id = id, %void, "the capture is void and is repeated");
                    repeats += 1;
                }
                Err(failure) => return Err(failure),
            }
        }
    }

    async fn attempt(
        &mut self,
        cameras: &[usize],
        id: &str,
        options: &CaptureOptions,
    ) -> Result<Vec<CameraCapture>, CaptureFailure> {
        let settled = self.settle(cameras, options.trigger).await?;
        let used: Vec<(&CaptureCamera, &Settled)> = cameras.iter().map(|c| &self.cameras[*c]).zip(&settled).collect();
        let outcome = match options.trigger {
            TriggerMode::Line => self.by_line(&used, id, options).await,
            TriggerMode::Software => self.by_software(&used, options).await,
        };
        if outcome.is_err() {
            // What is wrong is known already; that the lights do not answer either would not help.
            let _ = self.lights.off().await;
        }
        let joined = outcome.and_then(|(sequence, takes)| self.join(&sequence, takes));
        for (camera, _) in &used {
            match &joined {
                Ok(_) => camera.record.captured(id),
                Err(failure) => camera.record.voided(&failure.to_string()),
            }
        }
        let joined = joined?;
        let captures = cameras.iter().zip(settled).zip(joined);
        Ok(captures
            .map(|((&camera, settled), frames)| CameraCapture {
                camera,
                settled,
                frames,
            })
            .collect())
    }

    async fn settle(&mut self, cameras: &[usize], trigger: TriggerMode) -> Result<Vec<Settled>, CaptureFailure> {
        let wanted = self
            .cameras
            .iter_mut()
            .enumerate()
            .filter(|(at, _)| cameras.contains(at));
        let settling = wanted.map(|(_, camera)| async move { camera.settle(trigger).await.cloned() });
        try_join_all(settling).await
    }

    /// The light controller switches the lights and triggers the cameras.
    async fn by_line(
        &self,
        cameras: &[(&CaptureCamera, &Settled)],
        id: &str,
        options: &CaptureOptions,
    ) -> Result<(Sequence, Vec<Take>), CaptureFailure> {
        let channels: Vec<Channel> = Channel::all().collect();
        let exposure = longest_exposure(cameras);
        let frames = try_join_all(cameras.iter().map(|(camera, _)| camera.arm(channels.len()))).await?;
        let order = LightOrder {
            capture_id: id.to_owned(),
            channels: channels.clone(),
            on_time: exposure + options.on_margin,
            gap: options.gap,
        };
        let sequence = self.lights.run_sequence(order).await?;
        sequence.check(&channels, exposure)?;
        let deadline = tokio::time::Instant::now() + options.frame_timeout;
        let takes = cameras
            .iter()
            .zip(frames)
            .map(|(&(camera, settled), frames)| async move {
                let (events, end) =
                    collect(camera, frames, Channel::all().count(), deadline, options.frame_timeout).await;
                take(camera, settled, events, end)
            });
        Ok((sequence, join_all(takes).await))
    }

    /// One light, one software trigger and one frame of every camera at a time.
    async fn by_software(
        &self,
        cameras: &[(&CaptureCamera, &Settled)],
        options: &CaptureOptions,
    ) -> Result<(Sequence, Vec<Take>), CaptureFailure> {
        let count = Channel::all().count();
        let exposure = longest_exposure(cameras);
        let mut frames = try_join_all(cameras.iter().map(|(camera, _)| camera.arm(count))).await?;
        let mut takes: Vec<Take> = cameras
            .iter()
            .map(|(camera, settled)| take(camera, settled, Vec::new(), TakeEnd::Whole))
            .collect();
        let mut steps = Vec::with_capacity(count);
        for channel in Channel::all() {
            // It goes off by itself should this node die before the frames are here.
            let longest = exposure + options.on_margin + options.frame_timeout + Duration::from_secs(1);
            self.lights.set(channel, longest).await?;
            let switched_at = Instant::now();
            try_join_all(cameras.iter().map(|(camera, _)| camera.trigger())).await?;
            let triggered_at = switched_at + switched_at.elapsed() / 2;
            let deadline = tokio::time::Instant::now() + exposure + options.frame_timeout;
            let next = cameras.iter().zip(&mut frames).zip(&mut takes);
            join_all(next.map(|((&(camera, _), frames), take)| take_one(camera, frames, take, deadline, options)))
                .await;
            steps.push(Step {
                channel,
                switched_at: self.ros_time(switched_at),
                triggered_at: self.ros_time(triggered_at),
                ended_at: self.ros_time(Instant::now()),
            });
            if let Some(take) = takes.iter().find(|take| take.events.len() < steps.len()) {
                return Err(missing(take, channel, count).into());
            }
            tokio::time::sleep(options.gap.min(Duration::from_millis(1))).await;
        }
        self.lights.off().await?;
        Ok((
            Sequence {
                steps,
                clock_uncertainty: Duration::ZERO,
                interval_tolerance: SOFTWARE_INTERVAL_TOLERANCE,
            },
            takes,
        ))
    }

    fn join(&self, sequence: &Sequence, takes: Vec<Take>) -> Result<Vec<Vec<JoinedFrame>>, CaptureFailure> {
        let joined = takes
            .into_iter()
            .map(|take| join(sequence, take, |instant| self.ros_time(instant)));
        Ok(joined.collect::<Result<_, Void>>()?)
    }

    /// An instant of this host as nanoseconds of the node's clock.
    fn ros_time(&self, instant: Instant) -> i64 {
        let (now, here) = (self.clock.now_nanos(), Instant::now());
        let nanos = |duration: Duration| i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX);
        now - nanos(here.saturating_duration_since(instant)) + nanos(instant.saturating_duration_since(here))
    }
}

fn longest_exposure(cameras: &[(&CaptureCamera, &Settled)]) -> Duration {
    let exposures = cameras.iter().map(|(_, settled)| settled.applied.settings.exposure);
    exposures.max().unwrap_or_default()
}

fn take(camera: &CaptureCamera, settled: &Settled, events: Vec<FrameEvent>, end: TakeEnd) -> Take {
    Take {
        camera: camera.name.clone(),
        exposure: settled.applied.settings.exposure,
        size: [settled.applied.width, settled.applied.height],
        events,
        end,
    }
}

async fn take_one(
    camera: &CaptureCamera,
    frames: &mut Frames,
    take: &mut Take,
    deadline: tokio::time::Instant,
    options: &CaptureOptions,
) {
    match tokio::time::timeout_at(deadline, frames.recv()).await {
        Ok(Some(event)) => take.events.push(event),
        Ok(None) => take.end = camera.loss(),
        Err(_) => take.end = TakeEnd::Silence(options.frame_timeout),
    }
}

fn missing(take: &Take, channel: Channel, expected: usize) -> Void {
    let found = take.events.len();
    Void::Missing {
        camera: take.camera.clone(),
        step: found,
        channel,
        found,
        expected,
        why: take.end.why(),
    }
}
