//! The stages of a cycle and how long they took.

use std::fmt;
use std::time::Duration;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    Capture,
    Solve,
    Plan,
    Execute,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Capture => "capture",
            Self::Solve => "solve",
            Self::Plan => "plan",
            Self::Execute => "execute",
        })
    }
}

/// Times are since the cycle's begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Timing {
    pub(crate) stage: Stage,
    pub(crate) began: Duration,
    /// None while it runs.
    pub(crate) ended: Option<Duration>,
    pub(crate) succeeded: bool,
}

/// The stages so far, in order. At most the last one runs.
#[derive(Debug, Clone, Default)]
pub(super) struct Timings(Vec<Timing>);

impl Timings {
    /// A stage that still runs has succeeded when the next begins.
    pub(super) fn open(&mut self, stage: Stage, now: Duration) {
        self.close(true, now);
        self.0.push(Timing {
            stage,
            began: now,
            ended: None,
            succeeded: false,
        });
    }

    pub(super) fn close(&mut self, succeeded: bool, now: Duration) {
        if let Some(timing) = self.0.last_mut().filter(|timing| timing.ended.is_none()) {
            timing.ended = Some(now);
            timing.succeeded = succeeded;
        }
    }

    pub(super) fn all(&self) -> &[Timing] {
        &self.0
    }

    /// The stage that runs, or the last one.
    pub(super) fn last(&self) -> Option<Stage> {
        self.0.last().map(|timing| timing.stage)
    }
}
