use core::fmt;

use crate::LightProtocolError;
use crate::error::bad_field;

/// Panels of the cell: L1..L7.
pub const PANEL_COUNT: u8 = 7;

/// A set of panels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Panels(u8);

impl Panels {
    /// Dark.
    pub const NONE: Self = Self(0);
    /// L1..L7.
    pub const ALL: Self = Self((1 << PANEL_COUNT) - 1);

    /// Bit 0 = L1 .. bit 6 = L7.
    pub fn from_bits(bits: u8) -> Result<Self, LightProtocolError> {
        if bits > Self::ALL.0 {
            return Err(bad_field("panels", bits, "0 to 127 (bit 0 = L1 .. bit 6 = L7)"));
        }
        Ok(Self(bits))
    }

    /// Only panel `number`, 1..=7.
    pub fn single(number: u8) -> Result<Self, LightProtocolError> {
        if !(1..=PANEL_COUNT).contains(&number) {
            return Err(bad_field("panel", number, "1 to 7"));
        }
        Ok(Self(1 << (number - 1)))
    }

    /// Bit 0 = L1 .. bit 6 = L7.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The panels of both.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether panel `number`, 1..=7, is among them.
    pub const fn contains(self, number: u8) -> bool {
        number >= 1 && number <= PANEL_COUNT && self.0 >> (number - 1) & 1 == 1
    }
}

impl fmt::Display for Panels {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::NONE {
            return formatter.write_str("none");
        }
        let mut separator = "";
        for number in (1..=PANEL_COUNT).filter(|number| self.contains(*number)) {
            write!(formatter, "{separator}L{number}")?;
            separator = "+";
        }
        Ok(())
    }
}

/// A set of the cameras' trigger lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Triggers(u8);

impl Triggers {
    /// No camera.
    pub const NONE: Self = Self(0);
    /// Only C1.
    pub const C1: Self = Self(1);
    /// Only C2.
    pub const C2: Self = Self(2);
    /// C1 and C2.
    pub const BOTH: Self = Self(3);

    /// Bit 0 = C1, bit 1 = C2.
    pub fn from_bits(bits: u8) -> Result<Self, LightProtocolError> {
        if bits > Self::BOTH.0 {
            return Err(bad_field("triggers", bits, "0 to 3 (bit 0 = C1, bit 1 = C2)"));
        }
        Ok(Self(bits))
    }

    /// Bit 0 = C1, bit 1 = C2.
    pub const fn bits(self) -> u8 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn panels_are_named_from_one() -> Result<(), LightProtocolError> {
        let panels = Panels::single(1)?.with(Panels::single(7)?);
        assert_eq!((panels.bits(), panels.to_string().as_str()), (0x41, "L1+L7"));
        assert!(panels.contains(7) && !panels.contains(2) && !panels.contains(0) && !panels.contains(8));
        Ok(())
    }

    #[test]
    fn panels_and_cameras_that_do_not_exist_are_refused() {
        assert!(Panels::from_bits(0x80).is_err() && Panels::single(0).is_err() && Panels::single(8).is_err());
        let error = Triggers::from_bits(4).expect_err("there are two cameras");
        assert_eq!(
            error.to_string(),
            "triggers is 4, allowed is 0 to 3 (bit 0 = C1, bit 1 = C2)"
        );
    }
}
