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
    /// Of the gripper that the stem comes out of: a cylinder that holds it, metres; 0 (none) to 0.5.
    pub body_diameter: f64,
    /// From the lip to where the gripper begins, metres; 0 to 0.5.
    pub body_distance: f64,
}

impl Default for Cup {
    fn default() -> Self {
        Self {
            diameter: 0.02,
            compliance: 0.0015,
            stem_diameter: 0.012,
            stem_length: 0.06,
            body_diameter: 0.0,
            body_distance: 0.06,
        }
    }
}

impl Cup {
    /// Of the lip, metres.
    pub fn radius(&self) -> f64 {
        self.diameter / 2.0
    }

    /// From the lip's middle down to the lowest place of lip and gripper when the cup holds a surface whose normal is
    /// this much off the vertical, metres.
    pub(crate) fn reach_down(&self, normal_z: f64) -> f64 {
        let aside = (1.0 - normal_z * normal_z).max(0.0).sqrt();
        let body = self.body_diameter / 2.0 * aside - self.body_distance * normal_z;
        if self.body_diameter > 0.0 {
            body.max(self.radius() * aside)
        } else {
            self.radius() * aside
        }
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
        within("stem length", self.stem_length, 0.0..=0.5, "0 to 0.5 m")?;
        within("body diameter", self.body_diameter, 0.0..=0.5, "0 to 0.5 m")?;
        within("body distance", self.body_distance, 0.0..=0.5, "0 to 0.5 m")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tilted_gripper_comes_lower_than_the_lip_if_it_is_wide() {
        let wide = Cup {
            body_diameter: 0.12,
            body_distance: 0.012,
            ..Cup::default()
        };
        let tilt = 25.0_f64.to_radians();
        assert!(wide.reach_down(1.0).abs() < 1e-12);
        assert!((wide.reach_down(tilt.cos()) - 0.06 * tilt.sin() + 0.012 * tilt.cos()).abs() < 1e-12);
        assert!((Cup::default().reach_down(tilt.cos()) - 0.01 * tilt.sin()).abs() < 1e-12);
    }
}
