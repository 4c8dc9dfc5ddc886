//! The stream of set-points that was handed out, as the driver's task sees it.

use std::sync::Arc;

use devices::StreamFault;

use crate::faults::KnownError;
use crate::observed::Observed;
use crate::stream_end::{End, StreamEnd};

pub(crate) struct WatchedStream {
    end: Arc<StreamEnd>,
    /// The reports say that the controller does not follow; the controller is being asked why.
    suspect: bool,
}

/// What the reports mean for a stream.
#[derive(Debug, PartialEq)]
pub(crate) enum Verdict {
    Lives,
    /// The controller does not follow: it has to be asked whether it has an error.
    Suspect,
    Ended(End, String),
}

impl WatchedStream {
    pub(crate) fn new(end: Arc<StreamEnd>) -> Self {
        Self { end, suspect: false }
    }

    /// Ends it, if it has not ended by itself; gives the end that it has.
    pub(crate) fn end(&self, end: End) -> End {
        self.end.end(end);
        self.end.get().unwrap_or(end)
    }

    pub(crate) fn take_suspicion(&mut self) -> bool {
        std::mem::take(&mut self.suspect)
    }

    pub(crate) fn judge(&mut self, observed: &Observed, error: KnownError) -> Verdict {
        if let Some(end) = self.end.get() {
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
        if motion.follows() || self.suspect {
            return Verdict::Lives;
        }
        self.suspect = true;
        Verdict::Suspect
    }
}

fn describe(end: End) -> String {
    match end {
        End::Fault(fault) => fault.to_string(),
        End::Dropped => "it was dropped".to_owned(),
    }
}
