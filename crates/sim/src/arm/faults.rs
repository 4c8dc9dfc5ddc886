//! What goes wrong on the wires, when a test wants it to.

use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

/// What goes wrong from now on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ArmFaults {
    /// Requests wait so long before they are looked at.
    pub delay: Duration,
    /// Requests are read and neither done nor answered.
    pub silent: bool,
    /// No reports are sent.
    pub no_reports: bool,
    /// The pump runs, but no seal comes about.
    pub never_seals: bool,
}

/// Faults and the network's pause.
#[derive(Default)]
pub(super) struct FaultBox {
    state: Mutex<FaultState>,
    changed: Condvar,
}

#[derive(Default)]
struct FaultState {
    faults: ArmFaults,
    paused_until: Option<Instant>,
    odd_report: bool,
    ended: bool,
}

impl FaultBox {
    pub(super) fn set(&self, faults: ArmFaults) {
        self.state.lock().faults = faults;
        self.changed.notify_all();
    }

    pub(super) fn get(&self) -> ArmFaults {
        self.state.lock().faults
    }

    pub(super) fn pause(&self, time: Duration) {
        self.state.lock().paused_until = Some(Instant::now() + time);
        self.changed.notify_all();
    }

    pub(super) fn is_paused(&self) -> bool {
        self.state.lock().is_paused(Instant::now())
    }

    pub(super) fn send_odd_report(&self) {
        self.state.lock().odd_report = true;
    }

    /// Once for every wish.
    pub(super) fn take_odd_report(&self) -> bool {
        std::mem::take(&mut self.state.lock().odd_report)
    }

    /// Nobody waits any more.
    pub(super) fn end(&self) {
        self.state.lock().ended = true;
        self.changed.notify_all();
    }

    /// Waits as long as a request has to; false when it is not to be answered.
    pub(super) fn wait_to_answer(&self) -> bool {
        let mut state = self.state.lock();
        let read_at = Instant::now();
        loop {
            let delayed = read_at + state.faults.delay;
            let due = state.paused_until.map_or(delayed, |until| until.max(delayed));
            if state.ended || due <= Instant::now() {
                return !state.faults.silent && !state.ended;
            }
            self.changed.wait_until(&mut state, due);
        }
    }
}

impl FaultState {
    fn is_paused(&self, now: Instant) -> bool {
        self.paused_until.is_some_and(|until| now < until)
    }
}
