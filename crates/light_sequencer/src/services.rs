//! `lights/run_sequence` and `lights/set`, each in a task of its own: neither waits for the other.

use std::sync::Arc;

use devices::{LightBank, LightError, LightSequence, SequenceReport};
use interfaces::rakelight_msgs::srv::{
    RunLightSequence, RunLightSequenceRequest, RunLightSequenceResponse, SetLights, SetLightsRequest, SetLightsResponse,
};
use light_serial::LightController;
use ros::{Clock, Node, ServiceCall, ServiceServer};
use tokio::task::JoinSet;
use tracing::Instrument;

use crate::convert::{self, ClockPair};
use crate::error::Error;
use crate::parameters::Parameters;
use crate::record::Record;

pub(crate) struct Services {
    run: ServiceServer<RunLightSequence>,
    set: ServiceServer<SetLights>,
    sequencer: Arc<Sequencer>,
}

/// What a call needs.
struct Sequencer {
    parameters: Parameters,
    clock: Clock,
    lights: Arc<LightController>,
    record: Arc<Record>,
}

impl Services {
    pub(crate) fn new(
        node: &Node,
        parameters: Parameters,
        lights: Arc<LightController>,
        record: Arc<Record>,
    ) -> Result<Self, Error> {
        let sequencer = Sequencer {
            parameters,
            clock: node.clock().clone(),
            lights,
            record,
        };
        Ok(Self {
            run: node.service_server("lights/run_sequence")?,
            set: node.service_server("lights/set")?,
            sequencer: Arc::new(sequencer),
        })
    }

    pub(crate) fn spawn_into(self, tasks: &mut JoinSet<()>) {
        let Self { run, set, sequencer } = self;
        tasks.spawn(serve_run(run, Arc::clone(&sequencer)).in_current_span());
        tasks.spawn(serve_set(set, sequencer).in_current_span());
    }
}

/// Calls are answered in tasks of their own, so that one that comes during a sequence is told so at once.
async fn serve_run(mut server: ServiceServer<RunLightSequence>, sequencer: Arc<Sequencer>) {
    let mut calls = JoinSet::new();
    while let Some(call) = server.next().await {
        while calls.try_join_next().is_some() {}
        let sequencer = Arc::clone(&sequencer);
        calls.spawn(async move { sequencer.answer_run(call).await }.in_current_span());
    }
}

async fn serve_set(mut server: ServiceServer<SetLights>, sequencer: Arc<Sequencer>) {
    while let Some(call) = server.next().await {
        sequencer.answer_set(call).await;
    }
}

impl Sequencer {
    async fn answer_run(&self, call: ServiceCall<RunLightSequence>) {
        let response = match self.run(call.request()).await {
            Ok(response) => response,
            Err(error) => {
                let capture_id = &call.request().capture_id;
                tracing::warn!(capture_id, %error, "no light sequence");
                RunLightSequenceResponse {
                    message: error.to_string(),
                    ..RunLightSequenceResponse::default()
                }
            }
        };
        if let Err(error) = call.respond(response).await {
            tracing::warn!(%error, "an answer is lost");
        }
    }

    async fn run(&self, request: &RunLightSequenceRequest) -> Result<RunLightSequenceResponse, LightError> {
        let running = self.record.begin(&request.capture_id).ok_or(LightError::Busy)?;
        let outcome = self.run_asked(request).await;
        let ended = outcome.as_ref().map(|response| response.steps.clone());
        running.end(ended.map_err(ToString::to_string));
        outcome
    }

    async fn run_asked(&self, request: &RunLightSequenceRequest) -> Result<RunLightSequenceResponse, LightError> {
        let (delay, width) = (self.parameters.trigger_delay.get(), self.parameters.trigger_width.get());
        let asked = convert::sequence(request, delay, width)?;
        let report = self.lights.run_sequence(asked.clone()).await?;
        let capture_id = &request.capture_id;
        tracing::debug!(capture_id, channels = convert::channel_names(&asked), "light sequence");
        Ok(self.response(&asked, &report))
    }

    fn response(&self, asked: &LightSequence, report: &SequenceReport) -> RunLightSequenceResponse {
        RunLightSequenceResponse {
            success: true,
            message: String::new(),
            steps: convert::steps(asked, report, ClockPair::now(&self.clock)),
            clock_uncertainty: convert::duration_message(report.clock_uncertainty),
        }
    }

    async fn answer_set(&self, call: ServiceCall<SetLights>) {
        let outcome = self.set(call.request()).await;
        if let Err(error) = &outcome {
            tracing::warn!(%error, "the lights were not set");
        }
        // A sequence that runs is nobody's fault, and a fault that is known does not go by it.
        if outcome != Err(LightError::Busy) {
            self.record.done(outcome.clone().map_err(|error| error.to_string()));
        }
        let response = SetLightsResponse {
            success: outcome.is_ok(),
            message: outcome.err().map(|error| error.to_string()).unwrap_or_default(),
        };
        if let Err(error) = call.respond(response).await {
            tracing::warn!(%error, "an answer is lost");
        }
    }

    async fn set(&self, request: &SetLightsRequest) -> Result<(), LightError> {
        let panels = devices::PanelSet(request.on);
        if panels.is_none() {
            return self.lights.off().await;
        }
        let duration = convert::duration("duration", request.duration)?;
        self.lights.set(panels, duration).await?;
        tracing::info!(%panels, ?duration, "set by hand");
        Ok(())
    }
}
