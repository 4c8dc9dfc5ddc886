//! `lights/state`: what the lights do, for everybody to see.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{LightBank, LightBankState, LightLink, LightMode};
use interfaces::rakelight_msgs::msg::LightState;
use light_serial::LightController;
use ros::{Node, Publisher};
use tokio::time::MissedTickBehavior;

use crate::convert::duration_message;
use crate::record::{Record, Remembered};

pub(crate) const TOPIC: &str = "lights/state";

/// Half of what is promised: a subscriber that waits a second hears it in any case.
const PERIOD: Duration = Duration::from_millis(500);

/// Publishes on every change and every half second, until the task is ended.
pub(crate) async fn publish(
    node: Node,
    publisher: Publisher<LightState>,
    lights: Arc<LightController>,
    record: Arc<Record>,
) {
    let (mut bank, mut remembered) = (lights.state(), record.watch());
    drop((lights, record));
    let mut ticks = tokio::time::interval(PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut published = None;
    loop {
        let due = tokio::select! {
            _ = ticks.tick() => true,
            changed = bank.changed() => match changed {
                Ok(()) => false,
                Err(_) => return,
            },
            changed = remembered.changed() => match changed {
                // A sequence that ended is told even if it ended as the one before.
                Ok(()) => true,
                Err(_) => return,
            },
        };
        let state = message(
            &bank.borrow_and_update(),
            &remembered.borrow_and_update(),
            Instant::now(),
        );
        let shown = shown(&state);
        if due || published.as_ref() != Some(&shown) {
            published = Some(shown);
            send(&node, &publisher, state);
        }
    }
}

fn send(node: &Node, publisher: &Publisher<LightState>, mut state: LightState) {
    state.header.stamp = node.clock().now();
    if let Err(error) = publisher.publish(state) {
        tracing::warn!(%error, "a state of the lights is lost");
    }
}

/// What makes a state a new one: the time left does not.
fn shown(state: &LightState) -> LightState {
    LightState {
        expires_in: duration_message(Duration::ZERO),
        ..state.clone()
    }
}

fn message(bank: &LightBankState, remembered: &Remembered, now: Instant) -> LightState {
    let (mode, expires_in) = mode(bank, remembered, now);
    let (firmware_version, lost) = match &bank.link {
        LightLink::Connected { firmware_version, .. } => (firmware_version.clone(), None),
        LightLink::Disconnected { reason } => (String::new(), Some(reason.clone())),
    };
    let fault = match mode {
        LightState::DISCONNECTED => lost.unwrap_or_default(),
        LightState::FAULT => remembered.fault.clone(),
        _ => String::new(),
    };
    LightState {
        mode,
        on: bank.on.0,
        capture_id: remembered.capture_id.clone(),
        steps: remembered.steps.clone(),
        expires_in: duration_message(expires_in),
        firmware_version,
        fault,
        ..LightState::default()
    }
}

fn mode(bank: &LightBankState, remembered: &Remembered, now: Instant) -> (u8, Duration) {
    match (&bank.link, bank.mode) {
        (LightLink::Disconnected { .. }, _) => (LightState::DISCONNECTED, Duration::ZERO),
        (_, LightMode::Sequence) => (LightState::SEQUENCE, Duration::ZERO),
        (_, LightMode::Manual { until }) => (LightState::MANUAL, until.saturating_duration_since(now)),
        (_, LightMode::Idle) if !remembered.fault.is_empty() => (LightState::FAULT, Duration::ZERO),
        (_, LightMode::Idle) => (LightState::IDLE, Duration::ZERO),
    }
}

#[cfg(test)]
mod tests {
    use devices::PanelSet;

    use super::*;

    fn bank(mode: LightMode) -> LightBankState {
        LightBankState {
            link: LightLink::Connected {
                port: "/dev/ttyACM0".into(),
                firmware_version: "1.0.0".into(),
                clock_uncertainty: Duration::from_micros(100),
            },
            mode,
            on: PanelSet::NONE,
        }
    }

    #[test]
    fn a_fault_is_shown_while_nothing_else_happens() {
        let now = Instant::now();
        let remembered = Remembered {
            fault: "it was not acknowledged".into(),
            ..Remembered::default()
        };
        let idle = message(&bank(LightMode::Idle), &remembered, now);
        assert_eq!(
            (idle.mode, idle.fault.as_str()),
            (LightState::FAULT, "it was not acknowledged")
        );
        let running = message(&bank(LightMode::Sequence), &remembered, now);
        assert_eq!((running.mode, running.fault.as_str()), (LightState::SEQUENCE, ""));
    }

    #[test]
    fn a_lost_device_says_why() {
        let mut lost = bank(LightMode::Idle);
        lost.link = LightLink::Disconnected {
            reason: "unplugged".into(),
        };
        let state = message(&lost, &Remembered::default(), Instant::now());
        assert_eq!(
            (state.mode, state.fault.as_str()),
            (LightState::DISCONNECTED, "unplugged")
        );
        assert_eq!(state.firmware_version, "");
    }

    #[test]
    fn time_that_passes_makes_no_new_state() {
        let now = Instant::now();
        let manual = bank(LightMode::Manual {
            until: now + Duration::from_secs(5),
        });
        let first = message(&manual, &Remembered::default(), now);
        let second = message(&manual, &Remembered::default(), now + Duration::from_secs(1));
        assert_eq!(first.expires_in, duration_message(Duration::from_secs(5)));
        assert_ne!(first, second);
        assert_eq!(shown(&first), shown(&second));
    }
}
