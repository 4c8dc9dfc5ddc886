//! The stream of set-points that was handed out, as the driver's task sees it.

use std::sync::Arc;
use std::time::Instant;

use devices::StreamFault;

use crate::faults::KnownError;
use crate::observed::{Motion, Observed};
use crate::stream_end::{End, StreamEnd};

pub(crate) struct WatchedStream {
    end: Arc<StreamEnd>,
    doubt: Option<Doubt>,
}

/// The controller does not follow, by its reports or by what it answered to a set-point. Whether it has an error is being
/// asked, and what its mode is shows in the next report.
struct Doubt {
    since: Instant,
    answered: bool,
}

/// What the reports mean for a stream.
#[derive(Debug, PartialEq)]
pub(crate) enum Verdict {
    Lives,
    /// The controller has to be asked whether it has an error.
    Doubtful,
    Ended(End, String),
}

impl WatchedStream {
    pub(crate) fn new(end: Arc<StreamEnd>) -> Self {
        Self { end, doubt: None }
    }

    /// Ends it, if it has not ended by itself; gives the end that it has.
    pub(crate) fn end(&self, end: End) -> End {
        self.end.end(end);
        self.end.get().unwrap_or(end)
    }

    pub(crate) fn is_doubtful(&self) -> bool {
        self.doubt.is_some()
    }

    /// It is known now whether the controller has an error.
    pub(crate) fn answered(&mut self) {
        if let Some(doubt) = &mut self.doubt {
            doubt.answered = true;
        }
    }

    pub(crate) fn judge(&mut self, observed: &Observed, error: KnownError) -> Verdict {
        let own = self.end.get();
        if let Some(end @ (End::Dropped | End::Fault(StreamFault::Disconnected | StreamFault::Silent))) = own {
            return Verdict::Ended(end, describe(end));
        }
        let motion = match observed.both() {
            Ok((motion, _)) => motion,
            Err(reason) => {
                let end = End::Fault(StreamFault::Disconnected);
                return Verdict::Ended(end, format!("the arm is not seen any more: {reason}"));
            }
        };
        if let Some(fault) = error.fault() {
            let reason = format!("fault {}: {}", fault.code, fault.description);
            return Verdict::Ended(End::Fault(StreamFault::ControllerError), reason);
        }
        if own.is_none() && motion.follows() {
            self.doubt = None;
            return Verdict::Lives;
        }
        self.judge_doubtful(motion, own)
    }

    fn judge_doubtful(&mut self, motion: &Motion, own: Option<End>) -> Verdict {
        let Some(doubt) = &self.doubt else {
            self.doubt = Some(Doubt {
                since: Instant::now(),
                answered: false,
            });
            return Verdict::Doubtful;
        };
        if !doubt.answered || motion.received_at <= doubt.since {
            return Verdict::Lives;
        }
        match own {
            Some(end) if motion.follows() => Verdict::Ended(end, describe(end)),
            _ => Verdict::Ended(End::Fault(StreamFault::NotReady), taken(motion)),
        }
    }
}

fn taken(motion: &Motion) -> String {
    let (mode, state) = (motion.mode.number(), motion.state.number());
    format!("another client changed the arm's mode or state (now mode {mode}, state {state})")
}

fn describe(end: End) -> String {
    match end {
        End::Fault(fault) => fault.to_string(),
        End::Dropped => "it was dropped".to_owned(),
    }
}
