//! Why a motion was refused.

/// What is wrong, with which joint, what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrajectoryError {
    /// A number that is none.
    #[error("joint {joint}: {what} is {value}, expected a finite number")]
    NotFinite {
        /// Its number, 1 for the first.
        joint: usize,
        /// Which number.
        what: &'static str,
        /// As given.
        value: f64,
    },
    /// A limit that cannot be.
    #[error("joint {joint}: the limit of {what} is {value}, allowed: {allowed}")]
    Limit {
        /// Its number, 1 for the first.
        joint: usize,
        /// Of what.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// A motion that leaves its limits.
    #[error("joint {joint}: {what} reaches {value:.6}, allowed are {least:.6} to {most:.6}")]
    Outside {
        /// Its number, 1 for the first.
        joint: usize,
        /// Of what.
        what: &'static str,
        /// The extreme.
        value: f64,
        /// Smallest value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
}
