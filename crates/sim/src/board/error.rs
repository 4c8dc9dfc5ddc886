//! Why there is no board.

use std::path::PathBuf;

/// Every failure of the simulated board, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// The board was not built, because its tools were not there.
    #[error(
        "the simulated light controller was not built: not installed: {missing}. Run `cargo xtask setup`, then build again"
    )]
    NotBuilt {
        /// Package names.
        missing: &'static str,
    },
    /// A part of the board is not where it should be.
    #[error("the simulated light controller needs {}, which is not there (named by {named_by})", path.display())]
    PartMissing {
        /// The file.
        path: PathBuf,
        /// The environment variable or "this build".
        named_by: &'static str,
    },
    /// The child process did not start.
    #[error("cannot start {}: {source}", path.display())]
    Start {
        /// The program.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The child process is no more.
    #[error("the simulated light controller ended: {reason}")]
    Ended {
        /// Its last words.
        reason: String,
    },
    /// The child process does not do what it was asked for.
    #[error("the simulated light controller does not answer")]
    Silent,
    /// The link to the terminal cannot be made.
    #[error("cannot put a link at {}: {reason}", path.display())]
    Link {
        /// Where.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
}
