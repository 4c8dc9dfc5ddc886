//! Who may read and write: one client controls, until it lets go or falls silent.

use std::net::SocketAddrV4;
use std::time::Duration;

use super::Device;
use crate::bootstrap as at;
use crate::gvcp::Refusal;

/// The client that holds control.
#[derive(Debug, Clone, Copy)]
pub(super) struct Controller {
    pub(super) address: SocketAddrV4,
    pub(super) heard_at: Duration,
    exclusive: bool,
}

impl Device {
    pub(super) fn note_heartbeat(&mut self, now: Duration, from: SocketAddrV4) {
        if let Some(controller) = self.controller.as_mut().filter(|controller| controller.address == from) {
            controller.heard_at = now;
        }
    }

    pub(super) fn may_read(&self, from: SocketAddrV4) -> Result<(), Refusal> {
        let denied = |controller: Controller| controller.exclusive && controller.address != from;
        if self.controller.is_some_and(denied) {
            return Err(Refusal::AccessDenied);
        }
        Ok(())
    }

    pub(super) fn may_write(&self, from: SocketAddrV4) -> Result<(), Refusal> {
        if self.controller.is_some_and(|controller| controller.address == from) {
            Ok(())
        } else {
            Err(Refusal::AccessDenied)
        }
    }

    pub(super) fn write_privilege(&mut self, now: Duration, from: SocketAddrV4, value: u32) -> Result<(), Refusal> {
        if self.controller.is_some_and(|controller| controller.address != from) {
            return Err(Refusal::AccessDenied);
        }
        if value & (at::PRIVILEGE_CONTROL | at::PRIVILEGE_EXCLUSIVE) == 0 {
            self.release_control();
            return Ok(());
        }
        let exclusive = value & at::PRIVILEGE_EXCLUSIVE != 0;
        self.controller = Some(Controller {
            address: from,
            heard_at: now,
            exclusive,
        });
        self.memory.set_privilege(value & 3);
        Ok(())
    }

    fn release_control(&mut self) {
        self.controller = None;
        self.acquisition.stop();
        self.transmitter.clear();
        self.test_packet = false;
        self.last_write = None;
        self.memory.close();
    }

    pub(super) fn expire_control(&mut self, now: Duration) {
        let timeout = self.memory.heartbeat_timeout();
        let silent = |controller: Controller| now.saturating_sub(controller.heard_at) > timeout;
        if self.controller.is_some_and(silent) {
            self.counters.heartbeats_lost += 1;
            self.release_control();
        }
    }
}
