//! What holds the object.

use crate::error::GraspError;

/// A suction cup on a straight stem. The default is a small bellows cup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cup {
    /// Of the lip, metres; 0.002 to 0.2.
    pub diameter: f64,
    /// How far the lip gives before it leaks, metres; 0 (a hard ring) to the cup's radius.
    pub compliance: f64,
    /// Of everything that follows the cup into the work, metres; 0.001 to 0.3.
    pub stem_diameter: f64,
    /// From the lip to what need not come near the object, metres; 0 to 0.5.
    pub stem_length: f64,
}

impl Default for Cup {
    fn default() -> Self {
        Self {
            diameter: 0.02,
            compliance: 0.0015,
            stem_diameter: 0.012,
            stem_length: 0.06,
        }
    }
}

impl Cup {
    /// Of the lip, metres.
    pub fn radius(&self) -> f64 {
        self.diameter / 2.0
    }

    pub(crate) fn check(&self) -> Result<(), GraspError> {
        let within = GraspError::require_within;
        within("cup diameter", self.diameter, 0.002..=0.2, "0.002 to 0.2 m")?;
        within(
            "cup compliance",
            self.compliance,
            0.0..=self.radius(),
            "0 m to the cup's radius",
        )?;
        within("stem diameter", self.stem_diameter, 0.001..=0.3, "0.001 to 0.3 m")?;
        within("stem length", self.stem_length, 0.0..=0.5, "0 to 0.5 m")
    }
}
