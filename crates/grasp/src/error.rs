//! Why nothing could be planned.

/// What is wrong with the input, with what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GraspError {
    /// Planning takes one view or two.
    #[error("{found} views were given, allowed: 1 or 2")]
    Views {
        /// How many were given.
        found: usize,
    },
    /// An image does not fit its camera.
    #[error("view {view}: {what} is {width} x {height}, expected {expected_width} x {expected_height}")]
    OtherSize {
        /// Name of the view.
        view: String,
        /// Which image.
        what: &'static str,
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
        /// Columns of the camera.
        expected_width: usize,
        /// Rows of the camera.
        expected_height: usize,
    },
    /// A camera that does not look down on the table.
    #[error("view {view}: the camera is {height} m above the table, allowed: more than 0.01")]
    BelowTable {
        /// Name of the view.
        view: String,
        /// Of its centre over the table, metres.
        height: f64,
    },
    /// A number out of its range, or none.
    #[error("{what} = {value}, allowed: {allowed}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words, with its unit.
        allowed: &'static str,
    },
    /// A reachable direction without a direction.
    #[error("direction {index} is ({x}, {y}, {z}), allowed: finite vectors longer than 0")]
    Direction {
        /// Position in the list.
        index: usize,
        /// As given.
        x: f64,
        /// As given.
        y: f64,
        /// As given.
        z: f64,
    },
}

impl GraspError {
    /// Refuses a number outside a range; NaN is outside of all.
    pub(crate) fn require_within(
        what: &'static str,
        value: f64,
        range: std::ops::RangeInclusive<f64>,
        allowed: &'static str,
    ) -> Result<(), Self> {
        if range.contains(&value) {
            return Ok(());
        }
        Err(Self::OutOfRange { what, value, allowed })
    }
}
