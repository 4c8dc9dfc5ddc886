//! How far the last captures are, for everybody who waits for one.

use std::sync::Arc;
use std::time::Duration;

use interfaces::builtin_interfaces::msg::Time;
use tokio::sync::watch;
use tokio::time::{Instant, timeout_at};

use crate::error::Refusal;

/// Captures that are remembered; of each a few words.
const REMEMBERED: usize = 16;

/// A capture is announced before its images are on their way: this long a camera may take to begin.
const BEGINNING: Duration = Duration::from_secs(1);

/// What came of one camera's share of a capture.
#[derive(Debug, Clone)]
enum Share {
    Collecting,
    Solving,
    Solved(Done),
    Failed(String),
}

/// A share that was solved.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Done {
    /// Share of the pixels that have a normal, 0 to 1.
    pub(crate) valid_fraction: f32,
    pub(crate) started_at: Time,
    pub(crate) took: Duration,
    /// What was missing, for people; empty: nothing.
    pub(crate) note: String,
}

#[derive(Debug, Clone)]
struct Record {
    id: String,
    began: Instant,
    /// Camera and share, in the order they began.
    shares: Vec<(String, Share)>,
}

/// The captures of all cameras. Clones are handles to the same.
#[derive(Clone, Default)]
pub(crate) struct Captures {
    /// Oldest first.
    records: Arc<watch::Sender<Vec<Record>>>,
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Ask {
    /// Empty: the last one.
    pub(crate) capture_id: String,
    /// Each once; none: those that took part.
    pub(crate) cameras: Vec<String>,
}

/// What came of a capture.
#[derive(Debug, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) id: String,
    /// Camera and what came of it, in the order asked for.
    pub(crate) solved: Vec<(String, Done)>,
    /// Of each camera without normals, why; for people.
    pub(crate) problems: Vec<String>,
}

impl Captures {
    /// A camera takes part in a capture; what it had under this id is void.
    pub(crate) fn begin(&self, id: &str, camera: &str) {
        self.records.send_modify(|records| {
            let known = records.iter().position(|record| record.id == id);
            let is_new = |record: &Record| record.shares.iter().all(|(name, _)| name != camera);
            let share = (camera.to_owned(), Share::Collecting);
            if let Some(at) = known.filter(|&at| is_new(&records[at])) {
                records[at].shares.push(share);
                return;
            }
            // When it is taken or played again, that makes it the last one.
            let again = known.map(|at| records.remove(at));
            let mut shares = again.map(|record| record.shares).unwrap_or_default();
            shares.retain(|(name, _)| name != camera);
            shares.push(share);
            records.push(Record {
                id: id.to_owned(),
                began: Instant::now(),
                shares,
            });
            records.drain(..records.len().saturating_sub(REMEMBERED));
        });
    }

    /// All images of a camera's share are there.
    pub(crate) fn solving(&self, id: &str, camera: &str) {
        self.settle(id, camera, Share::Solving);
    }

    pub(crate) fn solved(&self, id: &str, camera: &str, done: Done) {
        self.settle(id, camera, Share::Solved(done));
    }

    pub(crate) fn failed(&self, id: &str, camera: &str, reason: String) {
        self.settle(id, camera, Share::Failed(reason));
    }

    fn settle(&self, id: &str, camera: &str, share: Share) {
        self.records.send_modify(|records| {
            let record = records.iter_mut().find(|record| record.id == id);
            let known = record.and_then(|record| record.shares.iter_mut().find(|(name, _)| name == camera));
            if let Some((_, settled)) = known {
                *settled = share;
            }
        });
    }

    /// What came of a capture, once nothing of it is under way; what is after `patience` is among the problems.
    /// `cameras` are all that may take part.
    pub(crate) async fn wait(&self, ask: &Ask, cameras: &[String], patience: Duration) -> Result<Outcome, Refusal> {
        let asked = Instant::now();
        let deadline = asked + patience;
        let expected = if ask.cameras.is_empty() { cameras } else { &ask.cameras };
        let mut changes = self.records.subscribe();
        loop {
            let open_until = open_until(&changes.borrow_and_update(), &ask.capture_id, expected, asked, deadline);
            let Some(until) = open_until.filter(|until| *until > Instant::now()) else {
                return outcome(&self.records.borrow(), ask, asked.elapsed().as_secs_f64());
            };
            // Whether something changed or the time is over: it is looked at again.
            let _ = timeout_at(until, changes.changed()).await;
        }
    }
}

/// When a capture is settled if nothing changes; none when it is.
fn open_until(records: &[Record], id: &str, expected: &[String], asked: Instant, deadline: Instant) -> Option<Instant> {
    // A camera that is at work on one capture has not looked at the next.
    let is_busy = |camera: &String| {
        let mut shares = records.iter().filter_map(|record| record.share(camera));
        shares.any(Share::is_under_way)
    };
    let Some(record) = find(records, id) else {
        let is_any_busy = expected.iter().any(is_busy);
        return Some(if is_any_busy {
            deadline
        } else {
            deadline.min(asked + BEGINNING)
        });
    };
    let of_camera = |camera: &String| match record.share(camera) {
        Some(share) => share.is_under_way().then_some(deadline),
        None if is_busy(camera) => Some(deadline),
        None => Some(deadline.min(record.began + BEGINNING)),
    };
    expected.iter().filter_map(of_camera).max()
}

fn outcome(records: &[Record], ask: &Ask, waited: f64) -> Result<Outcome, Refusal> {
    let id = &ask.capture_id;
    match find(records, id) {
        Some(record) => Ok(record.outcome(&ask.cameras, waited)),
        None if id.is_empty() => Err(Refusal::NoCapture { waited }),
        None => Err(Refusal::UnknownCapture {
            id: id.clone(),
            waited,
            known: known(records),
        }),
    }
}

fn find<'a>(records: &'a [Record], id: &str) -> Option<&'a Record> {
    if id.is_empty() {
        return records.last();
    }
    records.iter().find(|record| record.id == id)
}

fn known(records: &[Record]) -> String {
    if records.is_empty() {
        return "none".into();
    }
    let ids: Vec<&str> = records.iter().map(|record| record.id.as_str()).collect();
    ids.join(", ")
}

impl Share {
    fn is_under_way(&self) -> bool {
        matches!(self, Self::Collecting | Self::Solving)
    }
}

impl Record {
    fn share(&self, camera: &str) -> Option<&Share> {
        let mut shares = self.shares.iter();
        shares.find(|(name, _)| name == camera).map(|(_, share)| share)
    }

    fn outcome(&self, cameras: &[String], waited: f64) -> Outcome {
        let took_part: Vec<String> = self.shares.iter().map(|(name, _)| name.clone()).collect();
        let cameras = if cameras.is_empty() { &took_part } else { cameras };
        let (mut solved, mut problems) = (Vec::new(), Vec::new());
        for camera in cameras {
            match self.share(camera) {
                Some(Share::Solved(done)) => solved.push((camera.clone(), done.clone())),
                Some(Share::Failed(reason)) => problems.push(format!("{camera}: {reason}")),
                Some(Share::Collecting) => {
                    problems.push(format!("{camera}: not all of its images came within {waited:.1} s"));
                }
                Some(Share::Solving) => problems.push(format!("{camera} was still being solved after {waited:.1} s")),
                None => problems.push(format!("{camera} took no part in it")),
            }
        }
        Outcome {
            id: self.id.clone(),
            solved,
            problems,
        }
    }
}

#[cfg(test)]
mod tests;
