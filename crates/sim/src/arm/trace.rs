//! What came in servo mode, and when.

use std::collections::VecDeque;
use std::time::Instant;

/// Set-points kept: some nine minutes at 250 Hz.
const MOST: usize = 1 << 17;

/// A set-point as it came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoPoint {
    /// When it was read from the socket.
    pub at: Instant,
    /// Radians.
    pub angles: [f64; 7],
    /// Whether it was taken, or refused because the arm was not ready, in another mode, or by an error.
    pub taken: bool,
}

#[derive(Debug, Default)]
pub(super) struct ServoTrace {
    points: VecDeque<ServoPoint>,
}

impl ServoTrace {
    pub(super) fn push(&mut self, point: ServoPoint) {
        if self.points.len() == MOST {
            self.points.pop_front();
        }
        self.points.push_back(point);
    }

    pub(super) fn take(&mut self) -> Vec<ServoPoint> {
        self.points.drain(..).collect()
    }
}
