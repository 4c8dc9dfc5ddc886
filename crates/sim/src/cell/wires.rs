//! The light controller as the cameras feel it: which panels were lit while they exposed.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::timeline::Timeline;
use crate::board::LightBoard;

/// The board hands its edges out within about a millisecond; one that is this late has stopped.
const PATIENCE: Duration = Duration::from_secs(2);

#[derive(Debug, Default)]
pub(super) struct Wires {
    timeline: Mutex<Timeline>,
    board: Mutex<Option<Arc<LightBoard>>>,
}

impl Wires {
    /// Output 1 to 7 changed.
    pub(super) fn record(&self, output: u8, at: Instant, high: bool) {
        self.timeline.lock().record(output, at, high);
    }

    /// From now on there is a board, or none any more.
    pub(super) fn connect(&self, board: Option<Arc<LightBoard>>) {
        *self.board.lock() = board;
    }

    /// The share of an exposure for which each output was on; none when nobody can say, because the board has died.
    pub(super) fn shares(&self, from: Instant, length: Duration) -> Option<[f64; 7]> {
        let board = self.board.lock().clone();
        if let Some(board) = board
            && !board.wait_until(from + length, PATIENCE)
        {
            return None;
        }
        Some(self.timeline.lock().shares(from, length))
    }
}
