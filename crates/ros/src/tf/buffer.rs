//! What is known about frames, for everybody who asks.

use std::sync::Arc;
use std::time::Duration;

use geometry::RigidTransform;
use parking_lot::Mutex;
use tokio::sync::watch;

use super::error::TfError;
use super::message::StampedTransform;
use super::tree::Tree;

/// How far back a buffer remembers, unless told otherwise; TF2 has the same.
const KEPT: Duration = Duration::from_secs(10);

/// A tree of frames over time. Clones are handles to the same tree.
///
/// Times are nanoseconds of the node's clock. Of every moving frame the last ten seconds are kept.
#[derive(Clone)]
pub struct Buffer {
    inner: Arc<Inner>,
}

struct Inner {
    tree: Mutex<Tree>,
    kept: Duration,
    changed: watch::Sender<()>,
}

impl Default for Buffer {
    fn default() -> Self {
        Self::new(KEPT)
    }
}

impl Buffer {
    /// An empty buffer that remembers `kept` before each frame's newest transform.
    pub fn new(kept: Duration) -> Self {
        Self {
            inner: Arc::new(Inner {
                tree: Mutex::default(),
                kept,
                changed: watch::Sender::new(()),
            }),
        }
    }

    /// Adds where a moving frame is at a time. A second transform of the same time takes the first one's place.
    pub fn insert(&self, transform: &StampedTransform) -> Result<(), TfError> {
        self.add(transform, false)
    }

    /// Adds where a frame always is; a later one takes its place.
    pub fn insert_static(&self, transform: &StampedTransform) -> Result<(), TfError> {
        self.add(transform, true)
    }

    fn add(&self, transform: &StampedTransform, is_static: bool) -> Result<(), TfError> {
        self.inner.tree.lock().insert(transform, is_static, self.inner.kept)?;
        self.inner.changed.send_replace(());
        Ok(())
    }

    /// `target_from_source` at `time` (nanoseconds), in proportion between the neighbouring times where it has to be.
    /// Never guesses beyond the first and last known time.
    pub fn lookup(&self, target: &str, source: &str, time: i64) -> Result<RigidTransform, TfError> {
        self.inner.tree.lock().lookup(target, source, time)
    }

    /// `target_from_source` at the newest time that all frames between have in common, and that time; the time is 0
    /// when none of them moves.
    pub fn lookup_latest(&self, target: &str, source: &str) -> Result<(RigidTransform, i64), TfError> {
        let tree = self.inner.tree.lock();
        let time = tree.latest_common_time(target, source)?.unwrap_or(0);
        Ok((tree.lookup(target, source, time)?, time))
    }

    /// Waits until [`Self::lookup`] succeeds. When it does not within `timeout`, the error says what is missing.
    pub async fn wait_for(
        &self,
        target: &str,
        source: &str,
        time: i64,
        timeout: Duration,
    ) -> Result<RigidTransform, TfError> {
        self.wait_until(timeout, || self.lookup(target, source, time)).await
    }

    /// Waits until [`Self::lookup_latest`] succeeds.
    pub async fn wait_for_latest(
        &self,
        target: &str,
        source: &str,
        timeout: Duration,
    ) -> Result<(RigidTransform, i64), TfError> {
        self.wait_until(timeout, || self.lookup_latest(target, source)).await
    }

    async fn wait_until<T>(&self, timeout: Duration, lookup: impl Fn() -> Result<T, TfError>) -> Result<T, TfError> {
        let mut changed = self.inner.changed.subscribe();
        let found = async {
            loop {
                match lookup() {
                    Ok(found) => return found,
                    // The sender lives in this buffer.
                    Err(_) => drop(changed.changed().await),
                }
            }
        };
        match tokio::time::timeout(timeout, found).await {
            Ok(found) => Ok(found),
            Err(_) => lookup().map_err(|missing| TfError::TimedOut {
                waited: timeout,
                missing: Box::new(missing),
            }),
        }
    }

    /// Every known frame, sorted.
    pub fn frames(&self) -> Vec<String> {
        self.inner.tree.lock().names().into_iter().map(str::to_owned).collect()
    }

    /// Forgets moving frames, because time jumped and their stamps mean nothing any more. Static ones stay.
    pub fn forget_moving(&self) {
        self.inner.tree.lock().forget_moving();
        self.inner.changed.send_replace(());
    }
}
