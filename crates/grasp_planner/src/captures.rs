//! The last captures, with what each camera shows of them, for everybody who waits.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;

use crate::error::Refusal;
use crate::view::SolvedView;

/// What came of one camera's share of a capture.
#[derive(Debug, Clone)]
enum Share {
    /// With what has not come yet, for people.
    UnderWay(String),
    Solved(Arc<SolvedView>),
    Failed(String),
}

#[derive(Debug, Clone)]
struct Record {
    id: String,
    /// Camera and share, in the order they began.
    shares: Vec<(String, Share)>,
}

/// The captures that are kept. Clones are handles to the same.
#[derive(Clone, Default)]
pub(crate) struct Captures {
    /// Oldest first.
    records: Arc<watch::Sender<Vec<Record>>>,
}

/// A capture to plan on.
#[derive(Debug)]
pub(crate) struct SolvedCapture {
    pub(crate) id: String,
    /// At least one, by the cameras' names.
    pub(crate) views: Vec<Arc<SolvedView>>,
    /// Of each camera without a view, why; for people.
    pub(crate) missing: Vec<String>,
}

impl Captures {
    /// A camera took part in a capture; what it showed before under this id is void. Keeps the last `kept` captures.
    pub(crate) fn begin(&self, id: &str, camera: &str, kept: usize) {
        let under_way = || Share::UnderWay("results of normal_solver".into());
        self.records.send_modify(|records| {
            let known = records.iter().position(|record| record.id == id);
            let is_new = |record: &Record| record.shares.iter().all(|(name, _)| name != camera);
            let mut record = match known {
                Some(at) if is_new(&records[at]) => {
                    records[at].shares.push((camera.to_owned(), under_way()));
                    return;
                }
                // It is taken or played again, which makes it the last one.
                Some(at) => records.remove(at),
                None => Record {
                    id: id.to_owned(),
                    shares: Vec::new(),
                },
            };
            record.shares.retain(|(name, _)| name != camera);
            record.shares.push((camera.to_owned(), under_way()));
            records.push(record);
            records.drain(..records.len().saturating_sub(kept.max(1)));
        });
    }

    pub(crate) fn solved(&self, id: &str, view: SolvedView) {
        let camera = view.camera.clone();
        self.settle(id, &camera, Share::Solved(Arc::new(view)));
    }

    /// What of a camera's share has not come yet.
    pub(crate) fn awaits(&self, id: &str, camera: &str, awaited: String) {
        self.settle(id, camera, Share::UnderWay(awaited));
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

    /// The capture of this id, or the last one when it is empty, once nothing of it is under way; what is under way
    /// after `patience` is left out.
    pub(crate) async fn wait(
        &self,
        id: &str,
        cameras: &[String],
        patience: Duration,
    ) -> Result<SolvedCapture, Refusal> {
        let mut changes = self.records.subscribe();
        let is_settled = |records: &Vec<Record>| find(records, id).is_some_and(Record::is_settled);
        // Whether it settled or not, what is there then counts.
        let _ = tokio::time::timeout(patience, changes.wait_for(is_settled)).await;
        let records = self.records.borrow();
        let waited = patience.as_secs_f64();
        match find(&records, id) {
            Some(record) => record.capture(cameras, waited),
            None if id.is_empty() => Err(Refusal::NoCapture { waited }),
            None => Err(Refusal::UnknownCapture {
                id: id.to_owned(),
                waited,
                known: known(&records),
            }),
        }
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

impl Record {
    fn is_settled(&self) -> bool {
        self.shares
            .iter()
            .all(|(_, share)| !matches!(share, Share::UnderWay(_)))
    }

    fn capture(&self, cameras: &[String], waited: f64) -> Result<SolvedCapture, Refusal> {
        let (mut views, mut missing) = (Vec::new(), Vec::new());
        for camera in cameras {
            let share = self.shares.iter().find(|(name, _)| name == camera);
            match share.map(|(_, share)| share) {
                Some(Share::Solved(view)) => views.push(Arc::clone(view)),
                Some(Share::Failed(reason)) => missing.push(format!("{camera}: {reason}")),
                Some(Share::UnderWay(awaited)) => {
                    missing.push(format!("{camera}: {awaited} did not come within {waited:.1} s"));
                }
                None => missing.push(format!("{camera} took no part in it")),
            }
        }
        if views.is_empty() {
            return Err(Refusal::NotSolved {
                id: self.id.clone(),
                reasons: missing.join("; "),
            });
        }
        Ok(SolvedCapture {
            id: self.id.clone(),
            views,
            missing,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::tests::plate;

    const PATIENCE: Duration = Duration::from_millis(200);

    fn cameras() -> Vec<String> {
        vec!["c1".into(), "c2".into()]
    }

    async fn refusal(captures: &Captures, id: &str) -> String {
        let waited = captures.wait(id, &cameras(), PATIENCE).await;
        waited.expect_err("nothing to plan on").to_string()
    }

    #[tokio::test(start_paused = true)]
    async fn the_last_capture_is_given_when_all_of_it_is_there() {
        let captures = Captures::default();
        captures.begin("a", "c1", 3);
        captures.solved("a", plate("c1"));
        captures.begin("b", "c1", 3);
        captures.begin("b", "c2", 3);
        captures.solved("b", plate("c2"));
        let waiting = tokio::spawn({
            let captures = captures.clone();
            async move { captures.wait("", &cameras(), Duration::from_hours(1)).await }
        });
        tokio::task::yield_now().await;
        assert!(!waiting.is_finished());
        captures.solved("b", plate("c1"));
        let found = waiting.await.expect("no panic").expect("solved");
        assert_eq!((found.id.as_str(), found.missing.len()), ("b", 0));
        let names: Vec<&str> = found.views.iter().map(|view| view.camera.as_str()).collect();
        assert_eq!(names, ["c1", "c2"]);
    }

    #[tokio::test(start_paused = true)]
    async fn a_camera_that_is_gone_is_named_and_the_other_given() {
        let captures = Captures::default();
        captures.begin("a", "c2", 3);
        captures.solved("a", plate("c2"));
        let found = captures.wait("a", &cameras(), PATIENCE).await.expect("one view");
        assert_eq!(found.missing, ["c1 took no part in it"]);
        captures.begin("a", "c1", 3);
        let found = captures.wait("a", &cameras(), PATIENCE).await.expect("one view");
        assert_eq!(
            found.missing,
            ["c1: results of normal_solver did not come within 0.2 s"]
        );
        captures.awaits("a", "c1", "depth".into());
        let found = captures.wait("a", &cameras(), PATIENCE).await.expect("one view");
        assert_eq!(found.missing, ["c1: depth did not come within 0.2 s"]);
        captures.failed("a", "c1", "no camera_info has come".into());
        let found = captures.wait("a", &cameras(), PATIENCE).await.expect("one view");
        assert_eq!(found.missing, ["c1: no camera_info has come"]);
    }

    #[tokio::test(start_paused = true)]
    async fn what_cannot_be_planned_on_says_why() {
        let captures = Captures::default();
        assert!(refusal(&captures, "").await.contains("no capture has come"));
        assert!(refusal(&captures, "x").await.contains("known: none"));
        captures.begin("a", "c1", 3);
        let text = refusal(&captures, "a").await;
        assert!(
            text.contains("c1: results of") && text.contains("c2 took no part"),
            "{text}"
        );
        assert!(refusal(&captures, "x").await.contains("known: a"));
    }

    #[tokio::test(start_paused = true)]
    async fn the_oldest_goes_and_what_begins_anew_is_the_last() {
        let captures = Captures::default();
        for id in ["a", "b", "c"] {
            captures.begin(id, "c1", 2);
            captures.solved(id, plate("c1"));
        }
        assert!(refusal(&captures, "a").await.contains("known: b, c"));
        captures.begin("b", "c1", 2);
        captures.solved("b", plate("c1"));
        let last = captures.wait("", &cameras(), PATIENCE).await.expect("solved");
        assert_eq!(last.id, "b");
    }
}
