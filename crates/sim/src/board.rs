//! The light controller: the real firmware on a simulated ATmega328P, in a child process behind a pseudo-terminal.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::SimError;

/// How the board is set up.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BoardConfig {
    /// A symbolic link to the pseudo-terminal is put here and follows it, as `/dev/serial/by-id` does.
    pub link: Option<PathBuf>,
}

/// An output of the board that changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// When, to a fraction of a microsecond against other edges.
    pub at: Instant,
    /// Which.
    pub pin: Pin,
    /// To which level.
    pub high: bool,
}

/// Outputs of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pin {
    /// 1 to 7.
    Panel(u8),
    /// Trigger line of a camera: 1 or 2.
    Trigger(u8),
}

/// A running board. Dropping it ends the child process.
#[derive(Debug)]
pub struct LightBoard {}

impl LightBoard {
    /// Switches a board on. `edges` is called on the board's thread with every edge, in order.
    pub fn start(config: &BoardConfig, edges: impl FnMut(Edge) + Send + 'static) -> Result<Self, SimError> {
        let _ = (config, edges);
        unimplemented!("the board's helper writes this")
    }

    /// What a driver opens: the link, or the pseudo-terminal itself.
    pub fn port(&self) -> &Path {
        unimplemented!()
    }

    /// Waits until every edge before `instant` has been handed out; false when that takes longer than `timeout`.
    pub fn wait_until(&self, instant: Instant, timeout: Duration) -> bool {
        let _ = (instant, timeout);
        unimplemented!()
    }
}
