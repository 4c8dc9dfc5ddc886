//! What is sent, written down on the way.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use devices::{JointValues, SetPointStream, StreamFault};

/// A set-point and when it was handed to the driver.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sent {
    pub(crate) at: Instant,
    pub(crate) angles: JointValues,
}

/// Room for a number of set-points; those beyond are not written down. Nobody else looks while the loop runs, so that its
/// lock never waits.
#[derive(Clone)]
pub(crate) struct Log(Arc<Mutex<Vec<Sent>>>);

/// Passes set-points on to the driver, or to nobody.
pub(crate) struct Recorder {
    log: Log,
    driver: Option<Box<dyn SetPointStream>>,
    /// Set-points that are taken before the stream fails; none: all.
    pub(crate) fails_after: Option<usize>,
}

impl Log {
    pub(crate) fn with_room(set_points: usize) -> Self {
        Self(Arc::new(Mutex::new(Vec::with_capacity(set_points))))
    }

    pub(crate) fn recorder(&self, driver: Option<Box<dyn SetPointStream>>) -> Recorder {
        Recorder {
            log: self.clone(),
            driver,
            fails_after: None,
        }
    }

    /// All so far.
    pub(crate) fn sent(&self) -> Vec<Sent> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn push(&self, sent: Sent) {
        let mut log = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if log.len() < log.capacity() {
            log.push(sent);
        }
    }
}

impl SetPointStream for Recorder {
    fn send(&mut self, angles: &JointValues) -> Result<(), StreamFault> {
        let at = Instant::now();
        if let Some(left) = &mut self.fails_after {
            *left = left.checked_sub(1).ok_or(StreamFault::Disconnected)?;
        }
        if let Some(driver) = &mut self.driver {
            driver.send(angles)?;
        }
        self.log.push(Sent { at, angles: *angles });
        Ok(())
    }
}
