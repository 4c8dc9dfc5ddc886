//! The tool board: outputs, inputs, and the vacuum gripper on them.

/// Number of the tool board on the arm's bus.
pub const TOOL_HOST: u8 = 9;

/// Registers of the tool board.
pub mod tool_address {
    /// Inputs, see [`input_bit`](super::VacuumHardware::input_bit).
    pub const INPUTS: u16 = 0x0A14;
    /// Outputs to set: mask in the high byte, bits in the low one.
    pub const SET_OUTPUTS: u16 = 0x0A15;
    /// First analog input; the second follows.
    pub const ANALOG: u16 = 0x0A16;
    /// Outputs as they are.
    pub const OUTPUTS: u16 = 0x0A18;
    /// First of three numbers of its version.
    pub const VERSION: u16 = 0x0801;
}

/// How a vacuum gripper is wired to the arm. The wrong version is silent: the pump does not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum VacuumHardware {
    /// With a cable: pump on output 0, vent on output 1, detection on input 0.
    #[default]
    Cable,
    /// By contacts in the flange (arms from 1305 on): outputs 3 and 4, input 3.
    Contacts,
}

impl VacuumHardware {
    /// By the vendor's number, 1 or 2.
    pub fn of_version(version: u8) -> Option<Self> {
        match version {
            1 => Some(Self::Cable),
            2 => Some(Self::Contacts),
            _ => None,
        }
    }

    /// Bit of the pump's output. The numbering has a gap: output 2 is bit 4, outputs 3 and 4 are bits 2 and 3.
    pub fn pump_bit(self) -> u8 {
        match self {
            Self::Cable => 0x01,
            Self::Contacts => 0x04,
        }
    }

    /// Bit of the vent's output.
    pub fn vent_bit(self) -> u8 {
        match self {
            Self::Cable => 0x02,
            Self::Contacts => 0x08,
        }
    }

    /// Bit of the input that tells that something is held.
    pub fn input_bit(self) -> u8 {
        match self {
            Self::Cable => 0x01,
            Self::Contacts => 0x04,
        }
    }

    /// Values of [`SET_OUTPUTS`](tool_address::SET_OUTPUTS), to be written one after the other: the pump first, then the
    /// vent.
    pub fn writes(self, on: bool) -> [u16; 2] {
        let value = |bit: u8, on: bool| u16::from(bit) << 8 | if on { u16::from(bit) } else { 0 };
        [value(self.pump_bit(), on), value(self.vent_bit(), !on)]
    }

    /// Whether the pump runs and the vent is shut, by the outputs as they are.
    pub fn is_on(self, outputs: i32) -> bool {
        let has = |bit: u8| outputs & i32::from(bit) != 0;
        has(self.pump_bit()) && !has(self.vent_bit())
    }

    /// Whether something is held, by the inputs.
    pub fn is_held(self, inputs: i32) -> bool {
        inputs & i32::from(self.input_bit()) != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_are_those_of_the_vendor() {
        assert_eq!(VacuumHardware::Cable.writes(true), [0x0101, 0x0200]);
        assert_eq!(VacuumHardware::Cable.writes(false), [0x0100, 0x0202]);
        assert_eq!(VacuumHardware::Contacts.writes(true), [0x0404, 0x0800]);
        assert!(VacuumHardware::Contacts.is_on(0x04) && !VacuumHardware::Contacts.is_on(0x0C));
    }
}
