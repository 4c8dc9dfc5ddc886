//! What the threads of an arm share.

use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

use super::clients::Clients;
use super::core::Core;
use super::faults::FaultBox;
use super::ports::Doors;

pub(super) struct Shared {
    pub(super) core: Mutex<Core>,
    pub(super) clients: Clients,
    pub(super) faults: FaultBox,
    /// None while the controller is switched off.
    pub(super) doors: Mutex<Option<Doors>>,
    pub(super) ended: AtomicBool,
    /// What is told stays in order.
    pub(super) delivering: Mutex<()>,
}

impl Shared {
    pub(super) fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }

    /// Sends what the controller has to tell, unless nothing gets through; then it is kept.
    pub(super) fn deliver(&self) {
        if self.faults.is_paused() {
            return;
        }
        let _held = self.delivering.lock();
        let frames = std::mem::take(&mut self.core.lock().outbox);
        self.clients.send(frames);
    }
}
