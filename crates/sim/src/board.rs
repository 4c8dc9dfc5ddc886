//! The light controller: the real firmware on a simulated microcontroller (`ATmega328P`), in a child process behind a
//! pseudo-terminal.
//!
//! The child keeps the board's time in step with this computer's monotonic clock. When it was held up it catches up; when
//! it was held up for more than a quarter of a second the board's clock is set back instead ([`LightBoard::slips`]).
//! Either way edges are exact against each other in [`Edge::cycle`]s. An edge is handed out within about a millisecond.
//!
//! It needs `libsimavr` and `avr-gcc` where this crate is built; without them [`LightBoard::start`] says so. The
//! environment variables `RAKELIGHT_AVR_HOST` and `RAKELIGHT_LIGHT_FIRMWARE` name another program and another firmware.
//!
//! ```no_run
//! use sim::board::{BoardConfig, LightBoard};
//!
//! let board = LightBoard::start(&BoardConfig::default(), |edge| println!("{edge:?}"))?;
//! println!("lights at {}", board.port().display());
//! # Ok::<(), sim::SimError>(())
//! ```

mod child;
mod error;
mod faults;
mod line;
mod link;
mod parts;
mod progress;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::SimError;
use child::Child;
use link::Link;
use progress::Progress;

pub use error::BoardError;

/// How long a child may take for what it does at once.
const PATIENCE: Duration = Duration::from_secs(5);

/// How the board is set up.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BoardConfig {
    /// A symbolic link to the pseudo-terminal is put here and follows it, as `/dev/serial/by-id` does. Without it, there
    /// is one in a folder of its own.
    pub link: Option<PathBuf>,
    /// What runs on the board.
    pub firmware: BoardFirmware,
    /// Opening the port resets the board, as that of a real Uno does; its boot loader is silent for so long.
    pub reset_on_open: Option<Duration>,
}

/// What runs on the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BoardFirmware {
    /// This release's firmware.
    #[default]
    Released,
    /// The same, but for a protocol version that no release has.
    OtherProtocol,
}

/// An output of the board that changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// When, to a fraction of a microsecond against other edges unless the clock slipped between them.
    pub at: Instant,
    /// The board's CPU cycle, 16 to the microsecond, since it was switched on.
    pub cycle: u64,
    /// Which.
    pub pin: Pin,
    /// To which level.
    pub high: bool,
}

/// Outputs of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pin {
    /// 1 to 7.
    Panel(u8),
    /// Trigger line of a camera: 1 or 2.
    Trigger(u8),
}

/// How often and by how much the board's clock was set back, because this computer was too slow for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Slips {
    /// How often.
    pub count: u64,
    /// In sum.
    pub total: Duration,
}

/// A running board. Dropping it ends the child process.
#[derive(Debug)]
pub struct LightBoard {
    child: Child,
    progress: Arc<Progress>,
    link: Arc<Link>,
}

impl LightBoard {
    /// Switches a board on. `edges` is called on the board's thread with every edge, in order.
    pub fn start(config: &BoardConfig, edges: impl FnMut(Edge) + Send + 'static) -> Result<Self, SimError> {
        let parts = parts::find(config.firmware)?;
        let link = Arc::new(Link::new(config.link.as_deref())?);
        let progress = Arc::new(Progress::default());
        let listener = line::Listener::new(Arc::clone(&progress), Arc::clone(&link), edges);
        let child = Child::start(&parts, config.reset_on_open, listener)?;
        let board = Self { child, progress, link };
        board.wait_for_port(true)?;
        Ok(board)
    }

    /// What a driver opens: a link to the pseudo-terminal. It stays the same when that changes.
    pub fn port(&self) -> &Path {
        self.link.path()
    }

    /// Waits until every edge before `instant` has been handed out; false when that takes longer than `timeout`.
    pub fn wait_until(&self, instant: Instant, timeout: Duration) -> bool {
        let deadline = Instant::now() + timeout;
        std::thread::sleep(instant.min(deadline).saturating_duration_since(Instant::now()));
        // A board that ended makes no more edges, but those it would have made are missing.
        self.child.order("sync").is_ok() && self.progress.wait(deadline, |state| state.reached >= Some(instant))
    }

    /// The child process, for those who measure what it costs.
    pub fn process_id(&self) -> u32 {
        self.child.process_id()
    }

    /// How well the board kept in step with this computer's clock.
    pub fn slips(&self) -> Slips {
        self.progress.slips()
    }

    fn wait_for_port(&self, plugged: bool) -> Result<(), SimError> {
        let deadline = Instant::now() + PATIENCE;
        let arrived = self.progress.wait(deadline, |state| state.plugged == plugged);
        if let Some(reason) = self.progress.problem() {
            return Err(BoardError::Ended { reason }.into());
        }
        if arrived {
            Ok(())
        } else {
            Err(BoardError::Silent.into())
        }
    }
}
