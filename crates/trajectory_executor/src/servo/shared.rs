//! What both sides see at any time.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

use super::board::Board;
use super::timing::Timing;

pub(super) struct Shared {
    began: Instant,
    ended: AtomicBool,
    stop: AtomicBool,
    /// Nanoseconds since `began`; 0 for never.
    permitted_until: AtomicU64,
    pub(super) board: Board,
    pub(super) timing: Timing,
}

impl Shared {
    pub(super) fn new() -> Self {
        Self {
            began: Instant::now(),
            ended: AtomicBool::new(false),
            stop: AtomicBool::new(false),
            permitted_until: AtomicU64::new(0),
            board: Board::default(),
            timing: Timing::default(),
        }
    }

    pub(super) fn end(&self) {
        self.ended.store(true, Ordering::Release);
    }

    pub(super) fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }

    pub(super) fn request_stop(&self) {
        self.stop.store(true, Ordering::Release);
    }

    pub(super) fn clear_stop(&self) {
        self.stop.store(false, Ordering::Release);
    }

    pub(super) fn is_stop_requested(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    pub(super) fn permit_until(&self, end: Instant) {
        let nanos = end.saturating_duration_since(self.began).as_nanos() as u64;
        // A report that was overtaken by a newer one takes nothing back.
        self.permitted_until.fetch_max(nanos, Ordering::AcqRel);
    }

    pub(super) fn forbid(&self) {
        self.permitted_until.store(0, Ordering::Release);
    }

    pub(super) fn is_permitted(&self) -> bool {
        (self.began.elapsed().as_nanos() as u64) < self.permitted_until.load(Ordering::Acquire)
    }
}
