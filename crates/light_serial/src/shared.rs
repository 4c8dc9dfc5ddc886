//! What the driver's task tells everybody.

use devices::{LightBankState, LightLink, LightMode, PanelSet};
use parking_lot::Mutex;
use tokio::sync::watch;

use crate::statistics::LinkStatistics;

#[derive(Debug)]
pub(crate) struct Shared {
    state: watch::Sender<LightBankState>,
    statistics: Mutex<LinkStatistics>,
}

impl Shared {
    pub(crate) fn new(reason: String) -> Self {
        Self {
            state: watch::Sender::new(disconnected(reason)),
            statistics: Mutex::default(),
        }
    }

    pub(crate) fn subscribe(&self) -> watch::Receiver<LightBankState> {
        self.state.subscribe()
    }

    pub(crate) fn statistics(&self) -> LinkStatistics {
        self.statistics.lock().clone()
    }

    pub(crate) fn count(&self, change: impl FnOnce(&mut LinkStatistics)) {
        change(&mut self.statistics.lock());
    }

    pub(crate) fn fault(&self, text: String) {
        self.count(|statistics| statistics.last_fault = Some(text));
    }

    /// Wakes only who has something new to see.
    pub(crate) fn tell(&self, state: LightBankState) {
        self.state.send_if_modified(|known| {
            let new = *known != state;
            *known = state;
            new
        });
    }

    pub(crate) fn tell_disconnected(&self, reason: String) {
        self.tell(disconnected(reason));
    }
}

fn disconnected(reason: String) -> LightBankState {
    LightBankState {
        link: LightLink::Disconnected { reason },
        mode: LightMode::Idle,
        on: PanelSet::NONE,
    }
}
