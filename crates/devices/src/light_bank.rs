//! The lights.

use std::time::{Duration, Instant};

use futures::future::BoxFuture;
use tokio::sync::watch;

use crate::lights::{LightSequence, PanelSet};

/// The panels and the cameras' trigger lines. Whatever fails, the lights end off.
///
/// Dropping the bank turns the lights off and closes the device.
pub trait LightBank: Send + Sync {
    /// Runs a sequence and waits for its end. Only a sequence that ran whole, with every step reported, succeeds; one
    /// whose future is dropped is aborted.
    fn run_sequence(&self, sequence: LightSequence) -> BoxFuture<'_, Result<SequenceReport, LightError>>;

    /// Lights these panels and no others, until `duration` is over.
    fn set(&self, panels: PanelSet, duration: Duration) -> BoxFuture<'_, Result<(), LightError>>;

    /// All panels off, at once; aborts a sequence.
    fn off(&self) -> BoxFuture<'_, Result<(), LightError>>;

    /// What the lights do; changes wake the receiver.
    fn state(&self) -> watch::Receiver<LightBankState>;
}

/// What the lights do now.
#[derive(Debug, Clone, PartialEq)]
pub struct LightBankState {
    /// Whether the device answers.
    pub link: LightLink,
    /// What it is doing.
    pub mode: LightMode,
    /// Panels that are on, as far as the device has told.
    pub on: PanelSet,
}

/// Whether the device answers.
#[derive(Debug, Clone, PartialEq)]
pub enum LightLink {
    /// It does not. Its own watchdog has the lights off. The driver keeps trying.
    Disconnected {
        /// For people.
        reason: String,
    },
    /// It does.
    Connected {
        /// The port that it is at.
        port: String,
        /// "1.0.0".
        firmware_version: String,
        /// Standard deviation of the fit between its clock and this host's.
        clock_uncertainty: Duration,
    },
}

/// What the device is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightMode {
    /// All panels off.
    Idle,
    /// A sequence runs.
    Sequence,
    /// Panels set by hand.
    Manual {
        /// When they go off by themselves.
        until: Instant,
    },
}

/// A sequence that ran whole.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceReport {
    /// One for each step that was asked for, in order.
    pub steps: Vec<TimedStep>,
    /// Standard deviation of these times against this host's clock. Differences between them are exact to microseconds.
    pub clock_uncertainty: Duration,
}

/// A step as the device timed it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedStep {
    /// Panels that were lit.
    pub panels: PanelSet,
    /// The panels' rising edge.
    pub on_at: Instant,
    /// The trigger lines' rising edge.
    pub triggered_at: Instant,
    /// The panels' falling edge.
    pub off_at: Instant,
}

/// Why the lights did not do what was asked. The lights are off, or about to go off by themselves.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LightError {
    /// No device.
    #[error("the light controller does not answer: {reason}")]
    Disconnected {
        /// What was tried and what came of it.
        reason: String,
    },
    /// What was asked for is out of a range, or the device refused it.
    #[error("{reason}")]
    Refused {
        /// What, where, the value found and the values allowed.
        reason: String,
    },
    /// A sequence or setting is under way.
    #[error("the lights are busy: a sequence is running")]
    Busy,
    /// The sequence began and did not end whole.
    #[error("the light sequence did not run whole ({done} of {steps} steps): {reason}")]
    Incomplete {
        /// Steps that were reported.
        done: usize,
        /// Steps that were asked for.
        steps: usize,
        /// Why.
        reason: String,
    },
}
