//! What happens by itself: events of the servo loop, and the arm's state.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{ArmCondition, ArmLink, ArmState};
use tokio::time::MissedTickBehavior;

use super::{Executor, Standing};
use crate::error::MotionError;
use crate::servo::{ServoEvent, StopCause};

/// How often the loop's events are looked for.
const LOOK: Duration = Duration::from_millis(2);

impl Executor {
    /// Takes the servo loop's events until the task is ended.
    pub(crate) async fn attend_servo(self: Arc<Self>) {
        let mut ticks = tokio::time::interval(LOOK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            ticks.tick().await;
            loop {
                let Some(event) = self.servo.lock().take_event() else {
                    break;
                };
                self.take(event);
            }
        }
    }

    fn take(&self, event: ServoEvent) {
        match event {
            ServoEvent::Engaged => {
                self.standing.send_replace(Standing::Ready);
                self.engaged.notify_waiters();
            }
            ServoEvent::Finished { id } => {
                self.come_to_rest(None);
                self.end(id, Ok(()));
            }
            ServoEvent::Stopped { id, cause } => {
                if cause != StopCause::Requested {
                    tracing::error!(%cause, "a motion was stopped");
                }
                self.come_to_rest(Some(cause.to_string()));
                self.end(id, Err(MotionError::Stopped(cause)));
            }
            ServoEvent::Refused { id } => {
                self.come_to_rest(None);
                self.end(id, Err(MotionError::Busy));
            }
            ServoEvent::Lost { id, fault } => {
                tracing::error!(%fault, "the arm takes no set-points any more");
                self.standing.send_replace(Standing::Lost {
                    reason: fault.to_string(),
                });
                self.engaged.notify_waiters();
                if let Some(id) = id {
                    self.end(id, Err(MotionError::Lost(fault)));
                }
            }
        }
    }

    fn come_to_rest(&self, cause: Option<String>) {
        self.standing
            .send_modify(|standing| *standing = standing.at_rest(cause));
    }

    /// Permits motions for as long as the arm's reports are new and good.
    pub(crate) async fn attend_arm(self: Arc<Self>) {
        let mut state = self.arm.state();
        let (mut told, mut was_well) = (None, false);
        while state.changed().await.is_ok() {
            let seen = state.borrow_and_update().clone();
            let permitted = self.permitted_until(&seen);
            match permitted {
                Some(end) => self.remote.permit_until(end),
                None => self.remote.forbid(),
            }
            let now = Told::of(&seen);
            if told.as_ref() != Some(&now) {
                was_well |= now == Told::Well;
                now.log(was_well);
                told = Some(now);
            }
        }
    }

    fn permitted_until(&self, state: &ArmState) -> Option<Instant> {
        let is_good = matches!(state.link, ArmLink::Connected { .. })
            && matches!(state.condition, ArmCondition::Armed | ArmCondition::Moving);
        let joints = state.joints.as_ref().filter(|_| is_good)?;
        Some(joints.received_at + self.state_timeout)
    }
}

/// What of a state is worth a line in the log.
#[derive(PartialEq)]
enum Told {
    Disconnected(String),
    Fault(String),
    Well,
}

impl Told {
    fn of(state: &ArmState) -> Self {
        match (&state.link, &state.condition) {
            (ArmLink::Disconnected { reason }, _) => Self::Disconnected(reason.clone()),
            (_, ArmCondition::Fault(fault)) => Self::Fault(format!("{}: {}", fault.code, fault.description)),
            _ => Self::Well,
        }
    }

    /// A controller that is only being connected is nothing to be warned of.
    fn log(&self, was_well: bool) {
        match self {
            Self::Disconnected(reason) if !was_well => tracing::info!(reason, "the arm's controller is waited for"),
            Self::Disconnected(reason) => tracing::warn!(reason, "the arm's controller does not answer"),
            Self::Fault(fault) => tracing::error!(fault, "the arm has a fault"),
            Self::Well => tracing::info!("the arm answers and has no fault"),
        }
    }
}
