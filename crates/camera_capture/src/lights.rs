//! The lights, as another node offers them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use devices::{Channel, PanelSet};
use interfaces::builtin_interfaces::msg::Duration as DurationMessage;
use interfaces::rakelight_msgs::msg::LightStep;
use interfaces::rakelight_msgs::srv::{
    RunLightSequence, RunLightSequenceRequest, RunLightSequenceResponse, SetLights, SetLightsRequest,
};
use ros::{Node, ServiceClient};

use crate::join::{Sequence, Step, Void};

/// The light controller's own intervals are exact to microseconds; what is left is the camera's reaction.
const INTERVAL_TOLERANCE: Duration = Duration::from_micros(500);

/// How long the node of the lights may take beyond the sequence itself.
const PATIENCE: Duration = Duration::from_secs(2);

/// How long a node that ends waits for its last word to arrive.
const FAREWELL: Duration = Duration::from_millis(500);

/// Calls of the node `light_sequencer`.
pub(crate) struct Lights {
    run: ServiceClient<RunLightSequence>,
    set: ServiceClient<SetLights>,
    /// Whether a panel may be on because of us.
    may_be_lit: AtomicBool,
}

/// What is asked of the lights.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LightOrder {
    pub(crate) capture_id: String,
    pub(crate) channels: Vec<Channel>,
    pub(crate) on_time: Duration,
    pub(crate) gap: Duration,
}

impl Lights {
    pub(crate) fn new(node: &Node) -> Result<Self, ros::Error> {
        Ok(Self {
            run: node.service_client("lights/run_sequence")?,
            set: node.service_client("lights/set")?,
            may_be_lit: AtomicBool::new(false),
        })
    }

    /// Runs a sequence that also pulses the cameras' trigger lines; waits for its end.
    pub(crate) async fn run_sequence(&self, order: LightOrder) -> Result<Sequence, Void> {
        let length = (order.on_time + order.gap) * order.channels.len() as u32;
        let request = RunLightSequenceRequest {
            capture_id: order.capture_id,
            channels: order.channels.iter().map(|channel| channel.number()).collect(),
            on_time: message(order.on_time),
            gap: message(order.gap),
        };
        self.may_be_lit.store(true, Ordering::Relaxed);
        let answer = self
            .run
            .call(request, length + PATIENCE)
            .await
            .map_err(|e| failed(&e))?;
        if !answer.success {
            let reason = answer.message.clone();
            return Err(Void::Lights { reason });
        }
        self.may_be_lit.store(false, Ordering::Relaxed);
        sequence(&answer)
    }

    /// Lights what belongs to `channel`, nothing else, for `duration` at most.
    pub(crate) async fn set(&self, channel: Channel, duration: Duration) -> Result<(), Void> {
        self.may_be_lit.store(true, Ordering::Relaxed);
        self.set_panels(channel.panels(), duration).await
    }

    /// All off, unless it is certain that they are.
    pub(crate) async fn off(&self) -> Result<(), Void> {
        if self.may_be_lit.load(Ordering::Relaxed) {
            self.set_panels(PanelSet::NONE, Duration::ZERO).await?;
            self.may_be_lit.store(false, Ordering::Relaxed);
        }
        Ok(())
    }

    /// All off, unless it is certain that they are; for a node that is shut down and hears no answer any more.
    pub(crate) async fn leave_off(&self) {
        if !self.may_be_lit.load(Ordering::Relaxed) {
            return;
        }
        // Should this not arrive, they go off by themselves.
        if let Err(error) = self.set.tell(request(PanelSet::NONE, Duration::ZERO), FAREWELL).await {
            tracing::warn!(%error, "the lights were not told to go off");
        }
    }

    async fn set_panels(&self, panels: PanelSet, duration: Duration) -> Result<(), Void> {
        let answer = self
            .set
            .call(request(panels, duration), PATIENCE)
            .await
            .map_err(|e| failed(&e))?;
        if answer.success {
            return Ok(());
        }
        let reason = answer.message.clone();
        Err(Void::Lights { reason })
    }
}

fn request(panels: PanelSet, duration: Duration) -> SetLightsRequest {
    SetLightsRequest {
        on: panels.0,
        duration: message(duration),
    }
}

fn failed(error: &ros::Error) -> Void {
    let reason = error.to_string();
    Void::Lights { reason }
}

/// Durations of captures are far below the 68 years that the message holds.
fn message(duration: Duration) -> DurationMessage {
    DurationMessage::try_from(duration).unwrap_or_default()
}

fn sequence(answer: &RunLightSequenceResponse) -> Result<Sequence, Void> {
    let steps: Option<Vec<Step>> = answer.steps.iter().map(step).collect();
    let clock_uncertainty = Duration::try_from(answer.clock_uncertainty);
    match (steps, clock_uncertainty) {
        (Some(steps), Ok(clock_uncertainty)) => Ok(Sequence {
            steps,
            clock_uncertainty,
            interval_tolerance: INTERVAL_TOLERANCE,
        }),
        _ => Err(Void::Lights {
            reason: "the report of the sequence has a channel above 7 or a negative uncertainty".into(),
        }),
    }
}

fn step(step: &LightStep) -> Option<Step> {
    Some(Step {
        channel: Channel::new(step.channel)?,
        switched_at: step.switched_at.to_nanos(),
        triggered_at: step.triggered_at.to_nanos(),
        ended_at: step.ended_at.to_nanos(),
    })
}
