//! Commands that wait for their reply.

use std::time::Instant;

use devices::LightError;

use crate::convert::ManualLight;
use crate::job::Reply;
use crate::line::Sent;

pub(super) struct Pending {
    pub(super) sent: Sent,
    pub(super) purpose: Purpose,
}

/// Why a command was sent, and who waits for it.
pub(super) enum Purpose {
    Ping,
    Set {
        light: ManualLight,
        reply: Reply<()>,
    },
    /// The run itself is the session's activity.
    Sequence,
    Off {
        /// Number of what was under way.
        ends: Option<u8>,
        reply: Option<Reply<()>>,
    },
}

impl Purpose {
    pub(super) fn fail(self, error: LightError) {
        // Whoever asked may have gone.
        match self {
            Self::Set { reply, .. } | Self::Off { reply: Some(reply), .. } => drop(reply.send(Err(error))),
            Self::Off { reply: None, .. } | Self::Ping | Self::Sequence => {}
        }
    }
}

/// Oldest first.
#[derive(Default)]
pub(super) struct PendingList {
    list: Vec<Pending>,
    /// Since when something has been awaited without a word from the firmware.
    waiting_since: Option<Instant>,
}

impl PendingList {
    pub(super) fn push(&mut self, sent: Sent, purpose: Purpose) {
        self.waiting_since.get_or_insert(sent.at);
        self.list.push(Pending { sent, purpose });
    }

    /// A word came.
    pub(super) fn heard(&mut self) {
        self.waiting_since = (!self.list.is_empty()).then(Instant::now);
    }

    pub(super) fn waiting_since(&self) -> Option<Instant> {
        self.waiting_since
    }

    pub(super) fn take(&mut self, number: u8) -> Option<Pending> {
        let at = self.list.iter().position(|pending| pending.sent.number == number)?;
        let taken = self.list.remove(at);
        if self.list.is_empty() {
            self.waiting_since = None;
        }
        Some(taken)
    }

    /// Those that were sent before.
    pub(super) fn take_sent_before(&mut self, instant: Instant) -> Vec<Pending> {
        self.list.extract_if(.., |pending| pending.sent.at <= instant).collect()
    }

    pub(super) fn forget_sequence(&mut self) {
        self.list
            .retain(|pending| !matches!(pending.purpose, Purpose::Sequence));
    }

    pub(super) fn oldest(&self) -> Option<Instant> {
        self.list.iter().map(|pending| pending.sent.at).min()
    }

    pub(super) fn has_off(&self) -> bool {
        self.list
            .iter()
            .any(|pending| matches!(pending.purpose, Purpose::Off { .. }))
    }

    pub(super) fn has_set(&self) -> bool {
        self.list
            .iter()
            .any(|pending| matches!(pending.purpose, Purpose::Set { .. }))
    }
}
