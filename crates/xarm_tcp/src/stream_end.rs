//! How a stream of set-points ends, shared without a lock between the thread that sends and the driver's task.

use std::sync::atomic::{AtomicU8, Ordering};

use devices::StreamFault;

/// Live until somebody ends it; the first reason stays.
#[derive(Debug, Default)]
pub(crate) struct StreamEnd(AtomicU8);

/// Why it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Fault(StreamFault),
    /// Whoever had it wants no more.
    Dropped,
}

/// Their place is their number; 0 is live.
const ENDS: [End; 6] = [
    End::Fault(StreamFault::Disconnected),
    End::Fault(StreamFault::ControllerError),
    End::Fault(StreamFault::NotReady),
    End::Fault(StreamFault::Refused),
    End::Fault(StreamFault::Silent),
    End::Dropped,
];

impl StreamEnd {
    /// Nothing, if it has ended already.
    pub(crate) fn end(&self, end: End) {
        let number = ENDS.iter().position(|known| *known == end).map_or(0, |place| place + 1);
        // The first reason is the one to tell.
        let _ = self
            .0
            .compare_exchange(0, number as u8, Ordering::AcqRel, Ordering::Acquire);
    }

    /// None while it lives.
    pub(crate) fn get(&self) -> Option<End> {
        let number = self.0.load(Ordering::Acquire);
        ENDS.get(usize::from(number).checked_sub(1)?).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_reason_stays() {
        for end in ENDS {
            let stream = StreamEnd::default();
            assert_eq!(stream.get(), None);
            stream.end(end);
            stream.end(End::Fault(StreamFault::Silent));
            assert_eq!(stream.get(), Some(end));
        }
    }
}
