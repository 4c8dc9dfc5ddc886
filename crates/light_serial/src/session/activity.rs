//! The one thing that the firmware is doing.

use std::time::{Duration, Instant};

use devices::LightMode;

use crate::sequence_run::SequenceRun;

/// A SET whose end was not heard is ended by hand.
const EXPIRY_PATIENCE: Duration = Duration::from_millis(500);

pub(super) enum Activity {
    Idle,
    Manual { number: u8, until: Instant },
    Sequence(Box<SequenceRun>),
}

impl Activity {
    /// Of the command that began it.
    pub(super) fn number(&self) -> Option<u8> {
        match self {
            Self::Idle => None,
            Self::Manual { number, .. } => Some(*number),
            Self::Sequence(run) => Some(run.number),
        }
    }

    pub(super) fn mode(&self) -> LightMode {
        match self {
            Self::Idle => LightMode::Idle,
            Self::Manual { until, .. } => LightMode::Manual { until: *until },
            Self::Sequence(_) => LightMode::Sequence,
        }
    }

    /// By when the firmware must have said that it is over.
    pub(super) fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Idle => None,
            Self::Manual { until, .. } => Some(*until + EXPIRY_PATIENCE),
            Self::Sequence(run) => Some(run.deadline),
        }
    }

    pub(super) fn end(&mut self) -> Self {
        std::mem::replace(self, Self::Idle)
    }

    /// Of a sequence, when nobody waits for its report any more.
    pub(super) async fn given_up(&mut self) {
        match self {
            Self::Sequence(run) => run.given_up().await,
            _ => std::future::pending().await,
        }
    }
}
