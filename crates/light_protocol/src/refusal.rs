use core::fmt;

use crate::error::bad_field;
use crate::fields::{FieldReader, FieldWriter};
use crate::frame::Frame;
use crate::{CommandKind, LightProtocolError, PROTOCOL_VERSION};

/// A command was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// Code of the command as it came; 0 when it could not be read.
    pub command: u8,
    /// Why.
    pub reason: RefusalReason,
    /// Step from 0, or panel from 1, where the reason has one.
    pub index: u8,
    /// The limit, in the reason's unit.
    pub allowed: u32,
}

/// Why the firmware refused a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum RefusalReason {
    /// The frame's CRC was wrong.
    BadCrc = 1,
    /// No such command.
    UnknownCommand,
    /// The payload has the wrong length; allowed: bytes.
    BadLength,
    /// No HELLO of its protocol version since reset; allowed: that version.
    NoHello,
    /// A SEQ runs.
    Busy,
    /// Panels or triggers that do not exist; allowed: panels, plus 256 times triggers.
    BadMask,
    /// Allowed: the most.
    BadStepCount,
    /// Allowed: the least, microseconds.
    OnTimeShort,
    /// Allowed: the most, microseconds.
    OnTimeLong,
    /// Allowed: the least or the most, whichever was missed, microseconds.
    BadGap,
    /// Allowed: latest end of the pulse after the step's start, microseconds.
    BadTrigger,
    /// Allowed: on-time left to the panel, microseconds.
    Duty,
}

impl RefusalReason {
    const ALL: [Self; 12] = [
        Self::BadCrc,
        Self::UnknownCommand,
        Self::BadLength,
        Self::NoHello,
        Self::Busy,
        Self::BadMask,
        Self::BadStepCount,
        Self::OnTimeShort,
        Self::OnTimeLong,
        Self::BadGap,
        Self::BadTrigger,
        Self::Duty,
    ];
}

impl fmt::Display for Refusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { index, allowed, .. } = self;
        match CommandKind::from_code(self.command) {
            Some(command) => write!(formatter, "{command} refused: ")?,
            None => write!(formatter, "frame of kind {:#04x} refused: ", self.command)?,
        }
        match self.reason {
            RefusalReason::BadCrc => write!(formatter, "it arrived damaged (wrong CRC)"),
            RefusalReason::UnknownCommand => write!(formatter, "the firmware knows no such command"),
            RefusalReason::BadLength => write!(formatter, "its payload should have {allowed} bytes"),
            RefusalReason::NoHello => write!(
                formatter,
                "the controller was reset, or never greeted; its firmware speaks protocol {allowed}, this host \
                 {PROTOCOL_VERSION}"
            ),
            RefusalReason::Busy => write!(formatter, "a sequence is running"),
            RefusalReason::BadMask => write!(
                formatter,
                "step {index} names panels or cameras that do not exist (masks {:#04x} and {:#04x} are allowed)",
                allowed & 0xFF,
                allowed >> 8
            ),
            RefusalReason::BadStepCount => write!(formatter, "1 to {allowed} steps are allowed"),
            RefusalReason::OnTimeShort => write!(formatter, "step {index} is lit for less than {allowed} us"),
            RefusalReason::OnTimeLong => write!(formatter, "step {index} is lit for more than {allowed} us"),
            RefusalReason::BadGap => write!(formatter, "the gap after step {index} passes the limit of {allowed} us"),
            RefusalReason::BadTrigger => write!(
                formatter,
                "the trigger pulse does not fit into step {index}: it must end within {allowed} us, with edges at \
                 least 64 us apart"
            ),
            RefusalReason::Duty => write!(
                formatter,
                "panel L{index} has been on too long: {allowed} us are left to it, more will be after a rest"
            ),
        }
    }
}

impl Refusal {
    pub(crate) fn fields(self) -> FieldWriter {
        FieldWriter::new()
            .u8(self.command)
            .u8(self.reason as u8)
            .u8(self.index)
            .u32(self.allowed)
    }

    pub(crate) fn read(frame: &Frame) -> Result<Self, LightProtocolError> {
        let mut fields = FieldReader::new(frame, 7)?;
        let (command, reason) = (fields.u8(), fields.u8());
        let reason = RefusalReason::ALL.into_iter().find(|known| *known as u8 == reason);
        Ok(Self {
            command,
            reason: reason.ok_or_else(|| bad_field("a NAK's reason", frame.payload()[1], "1 to 12"))?,
            index: fields.u8(),
            allowed: fields.u32(),
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn a_refusal_says_what_would_be_allowed() {
        let refusal = Refusal {
            command: 4,
            reason: RefusalReason::Duty,
            index: 3,
            allowed: 1200,
        };
        assert_eq!(
            refusal.to_string(),
            "SEQ refused: panel L3 has been on too long: 1200 us are left to it, more will be after a rest"
        );
    }
}
