//! What the node remembers beyond what the driver knows: the last capture, and what last went wrong.

use std::sync::Arc;

use interfaces::rakelight_msgs::msg::LightStep;
use tokio::sync::watch;

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Remembered {
    /// Of the running or last sequence.
    pub(crate) capture_id: String,
    /// Empty until the sequence was reported.
    pub(crate) steps: Vec<LightStep>,
    /// Why the newest command failed; empty when it did not.
    pub(crate) fault: String,
    pub(crate) running: bool,
}

/// Changes wake its watchers.
#[derive(Debug, Default)]
pub(crate) struct Record {
    remembered: watch::Sender<Remembered>,
}

impl Record {
    pub(crate) fn watch(&self) -> watch::Receiver<Remembered> {
        self.remembered.subscribe()
    }

    /// A sequence begins, unless one is running: then it is left alone.
    pub(crate) fn begin(self: &Arc<Self>, capture_id: &str) -> Option<Running> {
        let begun = self.remembered.send_if_modified(|remembered| {
            if remembered.running {
                return false;
            }
            remembered.capture_id = capture_id.into();
            remembered.steps.clear();
            remembered.fault.clear();
            remembered.running = true;
            true
        });
        begun.then(|| Running {
            record: Arc::clone(self),
        })
    }

    /// A command was done, or why it was not.
    pub(crate) fn done(&self, outcome: Result<(), String>) {
        let fault = outcome.err().unwrap_or_default();
        self.remembered.send_if_modified(|remembered| {
            let new = remembered.fault != fault;
            remembered.fault = fault;
            new
        });
    }
}

/// The one sequence that runs, as far as the node knows. It ends with this, however that goes.
#[derive(Debug)]
pub(crate) struct Running {
    record: Arc<Record>,
}

impl Running {
    pub(crate) fn end(self, outcome: Result<Vec<LightStep>, String>) {
        self.record.remembered.send_modify(|remembered| {
            remembered.running = false;
            match outcome {
                Ok(steps) => remembered.steps = steps,
                Err(fault) => remembered.fault = fault,
            }
        });
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.record
            .remembered
            .send_if_modified(|remembered| std::mem::take(&mut remembered.running));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sequence_runs_at_a_time_and_ends_however_it_goes() {
        let record = Arc::new(Record::default());
        let running = record.begin("one").expect("none runs");
        assert!(record.begin("two").is_none());
        assert_eq!(record.watch().borrow().capture_id, "one");
        running.end(Ok(vec![LightStep::default()]));
        assert_eq!(record.watch().borrow().steps.len(), 1);
        drop(record.begin("three").expect("the first has ended"));
        assert!(record.watch().borrow().steps.is_empty());
        assert!(record.begin("four").is_some(), "the third was dropped");
    }

    #[test]
    fn a_fault_stays_until_something_succeeds() {
        let record = Arc::new(Record::default());
        record.begin("one").expect("none runs").end(Err("unplugged".into()));
        assert_eq!(record.watch().borrow().fault, "unplugged");
        record.done(Ok(()));
        assert_eq!(record.watch().borrow().fault, "");
    }
}
