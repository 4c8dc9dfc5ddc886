//! What others may ask of the node.

use std::sync::Arc;
use std::time::Instant;

use interfaces::Service;
use interfaces::rakelight_msgs::msg::{CellState, StageTiming};
use interfaces::rakelight_msgs::srv::{self, CaptureRequest, CaptureResponse};
use interfaces::std_srvs::srv::{Trigger, TriggerResponse};
use ros::{Clock, ServiceCall, ServiceServer};
use tokio::sync::{Mutex, MutexGuard, Semaphore, SemaphorePermit, watch};
use tokio::task::JoinSet;
use tracing::Instrument;

use crate::auto_exposure;
use crate::convert;
use crate::error::CaptureFailure;
use crate::light_watch::{LightWatch, Sample};
use crate::publish::{Answered, Job, PublishQueue};
use crate::session::{Capture, Session};

/// Callers that may wait for their turn: an operator's tools and the cell, not a runaway loop.
const WAITING: usize = 4;

/// What the services work on. Clones are handles to the same.
#[derive(Clone)]
pub(crate) struct Desk {
    session: Arc<Mutex<Session>>,
    queues: Arc<Vec<PublishQueue>>,
    watch: LightWatch,
    turns: Arc<Semaphore>,
    clock: Clock,
}

impl Desk {
    pub(crate) fn new(
        session: Arc<Mutex<Session>>,
        queues: Vec<PublishQueue>,
        watch: LightWatch,
        clock: Clock,
    ) -> Self {
        Self {
            session,
            queues: Arc::new(queues),
            watch,
            turns: Arc::new(Semaphore::new(1 + WAITING)),
            clock,
        }
    }

    /// `capture`. What it took leaves this process when the answer has.
    pub(crate) async fn capture(self, request: Arc<CaptureRequest>, answered: Answered) -> CaptureResponse {
        let (started, started_at) = (Instant::now(), self.clock.now());
        let outcome = self.take(&request.cameras, answered).await;
        let timing = StageTiming {
            stage: CellState::CAPTURE,
            succeeded: outcome.is_ok(),
            started_at,
            duration: convert::duration(started.elapsed()),
        };
        match outcome {
            Ok(response) => CaptureResponse { timing, ..response },
            Err(failure) => {
                tracing::warn!(%failure, "no capture");
                CaptureResponse {
                    message: failure.to_string(),
                    timing,
                    ..CaptureResponse::default()
                }
            }
        }
    }

    /// `~/auto_exposure`.
    pub(crate) async fn auto_exposure(self) -> TriggerResponse {
        let outcome = match self.turn().await {
            Ok((_permit, mut session)) => auto_exposure::adjust(&mut session).await,
            Err(failure) => Err(failure.to_string()),
        };
        answer(outcome, "exposures set")
    }

    /// `~/set_light_reference`.
    pub(crate) fn set_light_reference(&self) -> TriggerResponse {
        answer(self.watch.set_reference(), "reference set")
    }

    /// Waits for the cameras and lights; callers come in the order they asked.
    async fn turn(&self) -> Result<(SemaphorePermit<'_>, MutexGuard<'_, Session>), CaptureFailure> {
        let permit = self.turns.try_acquire();
        let permit = permit.map_err(|_| CaptureFailure::Busy { waiting: WAITING })?;
        Ok((permit, self.session.lock().await))
    }

    async fn take(&self, cameras: &[String], answered: Answered) -> Result<CaptureResponse, CaptureFailure> {
        let (_permit, mut session) = self.turn().await?;
        let places = session.select(cameras)?;
        let capture = session.capture(&places).await?;
        let response = CaptureResponse {
            success: true,
            capture_id: capture.id.clone(),
            stamp: convert::time(capture.stamp()),
            count: capture.cameras.first().map_or(0, |camera| camera.frames.len() as u8),
            repeats: capture.repeats,
            ..CaptureResponse::default()
        };
        self.hand_out(&session, capture, &answered);
        Ok(response)
    }

    /// Gives the images to those who publish and measure them; waits for neither.
    fn hand_out(&self, session: &Session, capture: Capture, answered: &Answered) {
        let mut samples = Vec::new();
        for taken in capture.cameras {
            let camera = &session.cameras[taken.camera];
            let messages = convert::messages(&capture.id, &camera.header(), &taken.settled, &taken.frames);
            self.queues[taken.camera].push(Job {
                capture_id: capture.id.clone(),
                messages,
                answered: answered.clone(),
            });
            samples.push(Sample {
                camera: camera.name.clone(),
                capture_id: capture.id.clone(),
                frames: taken.frames,
            });
        }
        self.watch.offer(samples);
    }
}

fn answer(outcome: Result<String, String>, what: &str) -> TriggerResponse {
    let success = outcome.is_ok();
    let message = outcome.unwrap_or_else(|problem| problem);
    if success {
        tracing::info!(message, "{what}");
    } else {
        tracing::warn!(message, "not all {what}");
    }
    TriggerResponse { success, message }
}

/// The services' ends.
pub(crate) struct Servers {
    pub(crate) capture: ServiceServer<srv::Capture>,
    pub(crate) auto_exposure: ServiceServer<Trigger>,
    pub(crate) set_light_reference: ServiceServer<Trigger>,
}

impl Servers {
    /// Answers until the node stops. Calls that are under way then are dropped: their cameras are disarmed.
    pub(crate) async fn run(mut self, desk: Desk) {
        let mut calls = JoinSet::new();
        loop {
            let desk = desk.clone();
            tokio::select! {
                call = self.capture.next() => {
                    let Some(call) = call else { break };
                    calls.spawn(answer_capture(call, desk).in_current_span());
                }
                call = self.auto_exposure.next() => {
                    let Some(call) = call else { break };
                    calls.spawn(respond(call, desk.auto_exposure()).in_current_span());
                }
                call = self.set_light_reference.next() => {
                    let Some(call) = call else { break };
                    calls.spawn(respond(call, async move { desk.set_light_reference() }).in_current_span());
                }
                Some(_) = calls.join_next() => {}
            }
        }
        calls.shutdown().await;
    }
}

async fn answer_capture(call: ServiceCall<srv::Capture>, desk: Desk) {
    let (not_yet, answered) = watch::channel(());
    let request = Arc::new(call.request().clone());
    respond(call, desk.capture(request, answered)).await;
    drop(not_yet);
}

async fn respond<S: Service>(call: ServiceCall<S>, response: impl Future<Output = S::Response>) {
    if let Err(error) = call.respond(response.await).await {
        tracing::warn!(%error, "an answer is lost");
    }
}
