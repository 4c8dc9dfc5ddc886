//! What a controller's firmware can do.

use std::fmt;
use std::str::FromStr;

use crate::error::ProtocolError;

/// A version; later ones compare greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Firmware {
    /// Layouts change with it.
    pub major: u16,
    /// Functions come with it.
    pub minor: u16,
    /// Corrections; some layouts changed here too.
    pub patch: u16,
}

impl Firmware {
    /// The first that is supported.
    pub const OLDEST: Self = Self::new(1, 8, 0);
    /// The first that is not.
    pub const END: Self = Self::new(3, 0, 0);

    /// By its numbers.
    pub const fn new(major: u16, minor: u16, patch: u16) -> Self {
        Self { major, minor, patch }
    }

    /// Refuses versions that nobody has tried.
    pub fn require_supported(self) -> Result<Self, ProtocolError> {
        if (Self::OLDEST..Self::END).contains(&self) {
            return Ok(self);
        }
        Err(ProtocolError::UnsupportedFirmware {
            found: self.to_string(),
            oldest: Self::OLDEST.to_string(),
            end: Self::END.to_string(),
        })
    }

    /// Clients that promise to keep the connection alive.
    pub fn has_keep_alive(self) -> bool {
        self >= Self::new(1, 8, 6)
    }

    /// Velocities that end by themselves.
    pub fn has_velocity_duration(self) -> bool {
        self >= Self::new(1, 8, 0)
    }

    /// Reads joint angles with velocities and efforts (the first branch had it from 1.8.103 on, the next from 1.9.110).
    pub fn has_joint_details(self) -> bool {
        self >= Self::new(1, 9, 110) || (self >= Self::new(1, 8, 103) && self < Self::new(1, 9, 0))
    }

    /// `set_mode` takes a second byte.
    pub fn has_mode_detection(self) -> bool {
        self >= Self::new(1, 10, 0)
    }

    /// `move_line` takes blending, frame and check.
    pub fn has_move_line_options(self) -> bool {
        self >= Self::new(1, 11, 100)
    }

    /// Tells the start and end of commands by itself.
    pub fn has_feedback(self) -> bool {
        self >= Self::new(2, 0, 102)
    }

    /// Tool outputs that do not wait for the motion queue; coordinates that are kept by sending infinity.
    pub fn has_immediate_tool_io(self) -> bool {
        self >= Self::new(2, 4, 101)
    }

    /// Bytes of the rich report, as far as is known: 574 were seen from 2.7.1.
    pub fn rich_report_length(self) -> usize {
        match self {
            _ if self >= Self::new(2, 8, 0) => 587,
            _ if self >= Self::new(2, 0, 0) => 574,
            _ if self >= Self::new(1, 10, 0) => 494,
            _ => 433,
        }
    }
}

impl fmt::Display for Firmware {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "v{}.{}.{}", self.major, self.minor, self.patch)
    }
}

impl FromStr for Firmware {
    type Err = ProtocolError;

    /// "v2.5.5", with or without the letter.
    fn from_str(text: &str) -> Result<Self, ProtocolError> {
        let numbers = text.strip_prefix('v').unwrap_or(text).split('.');
        let numbers: Option<Vec<u16>> = numbers.map(|number| number.parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[major, minor, patch]) => Ok(Self::new(major, minor, patch)),
            _ => Err(ProtocolError::Version { found: text.to_owned() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read_compared_and_written() {
        let firmware: Firmware = "v2.5.5".parse().expect("a version");
        assert_eq!(
            (firmware.to_string().as_str(), firmware.has_feedback()),
            ("v2.5.5", true)
        );
        assert!(!"1.12.10".parse::<Firmware>().expect("a version").has_feedback());
        for wrong in ["", "v2.5", "2.5.5.5", "v2.x.1", "v-1.0.0"] {
            assert!(wrong.parse::<Firmware>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_nobody_has_tried_is_refused() {
        let error = Firmware::new(9, 0, 0).require_supported().expect_err("not known");
        assert_eq!(
            error.to_string(),
            "firmware v9.0.0 is not known; supported are v1.8.0 up to, but not, v3.0.0"
        );
    }
}
