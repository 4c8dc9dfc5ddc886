//! What can be wrong with a calibration's input.

/// Why nothing was calibrated, with what was found and what is needed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CameraCalibrationError {
    /// A target that cannot be.
    #[error("target: {what} is {value}, allowed are {allowed}")]
    Target {
        /// The number.
        what: &'static str,
        /// As given.
        value: f64,
        /// In words.
        allowed: String,
    },
    /// The detector refuses the board.
    #[error("target: {reason}")]
    Board {
        /// In its words.
        reason: String,
    },
}
