use core::fmt;

use crate::error::bad_field;
use crate::fields::{FieldReader, FieldWriter};
use crate::frame::Frame;
use crate::{BoardTime, CommandKind, FIRMWARE_ID, LightProtocolError, PROTOCOL_VERSION, Panels, Refusal, Triggers};

mod code {
    pub(super) const HELLO: u8 = 0x81;
    pub(super) const ACK: u8 = 0x82;
    pub(super) const NAK: u8 = 0x83;
    pub(super) const BOOT: u8 = 0x91;
    pub(super) const STEP: u8 = 0x92;
    pub(super) const ENDED: u8 = 0x93;
}

const HELLO_BYTES: usize = 25;
/// Protocol version, firmware id, firmware version: the same in every version of the protocol.
const HELLO_FIXED_BYTES: usize = 8;

/// What the firmware says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    /// Answers HELLO.
    Hello(Hello),
    /// A command was done, or a SEQ accepted.
    Ack(Ack),
    /// A command was refused.
    Nak(Refusal),
    /// The firmware started; it wants a HELLO.
    Boot(Hello),
    /// A step of a SEQ is over.
    Step(StepReport),
    /// A SET or SEQ is over.
    Ended(Ended),
}

/// Who answers, and its limits. It speaks [`PROTOCOL_VERSION`], or decoding it would have been an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hello {
    /// Major, minor, patch.
    pub firmware_version: [u8; 3],
    /// Why the board last started.
    pub reset_cause: ResetCause,
    /// How many panels it switches.
    pub panels: u8,
    /// How many trigger lines it pulses.
    pub triggers: u8,
    /// Most steps of a SEQ.
    pub max_steps: u8,
    /// How much of the time a panel may be on in the long run, percent.
    pub duty_percent: u8,
    /// Silence after which the lights go off, milliseconds.
    pub watchdog_millis: u16,
    /// Longest SET, milliseconds.
    pub max_set_millis: u16,
    /// Longest step, microseconds.
    pub max_step_micros: u32,
    /// When it said so.
    pub at: BoardTime,
}

/// The MCU's reset flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResetCause(pub u8);

impl fmt::Display for ResetCause {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A watchdog matters most; after power on the brown-out flag is often set as well.
        formatter.write_str(match self.0 {
            flags if flags & 8 != 0 => "hardware watchdog",
            flags if flags & 1 != 0 => "power on",
            flags if flags & 4 != 0 => "brown-out",
            flags if flags & 2 != 0 => "reset line",
            _ => "unknown",
        })
    }
}

/// A command was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ack {
    /// Which.
    pub command: CommandKind,
    /// When the outputs were written; of a SEQ, when its first step starts.
    pub at: BoardTime,
    /// Panels that are on.
    pub lit: Panels,
}

/// Times of one step, as the firmware's clock read just after each port write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepReport {
    /// Position in the sequence, from 0.
    pub index: u8,
    /// Lit during the step.
    pub panels: Panels,
    /// Cameras that were triggered.
    pub triggers: Triggers,
    /// The panels' rising edge.
    pub on_at: BoardTime,
    /// The trigger lines' rising edge; `None` when no camera was triggered.
    pub trigger_at: Option<BoardTime>,
    /// The panels' falling edge.
    pub off_at: BoardTime,
}

/// A SET or SEQ is over: the panels are off, unless another SET took over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ended {
    /// Which of the two.
    pub command: CommandKind,
    /// Why.
    pub reason: EndReason,
    /// Steps of a SEQ that were done and reported.
    pub steps_done: u8,
    /// When the firmware said so.
    pub at: BoardTime,
}

/// Why a SET or SEQ is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum EndReason {
    /// Every step of a SEQ was done.
    Complete = 0,
    /// A SET's time was over.
    Expired,
    /// OFF or HELLO.
    Stopped,
    /// A new SET or SEQ took over from a SET.
    Replaced,
    /// No valid frame came for the watchdog's time.
    Silence,
}

impl EndReason {
    const ALL: [Self; 5] = [
        Self::Complete,
        Self::Expired,
        Self::Stopped,
        Self::Replaced,
        Self::Silence,
    ];
}

impl fmt::Display for EndReason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Complete => "complete",
            Self::Expired => "its time was over",
            Self::Stopped => "stopped by the host",
            Self::Replaced => "replaced by a newer command",
            Self::Silence => "the firmware heard nothing from the host and turned the lights off",
        })
    }
}

impl Message {
    /// The frame that carries it, as the firmware makes it.
    pub fn to_frame(&self, sequence_number: u8) -> Frame {
        match self {
            Self::Hello(hello) => hello.fields().frame(code::HELLO, sequence_number),
            Self::Boot(hello) => hello.fields().frame(code::BOOT, sequence_number),
            Self::Ack(ack) => ack.fields().frame(code::ACK, sequence_number),
            Self::Nak(refusal) => refusal.fields().frame(code::NAK, sequence_number),
            Self::Step(report) => report.fields().frame(code::STEP, sequence_number),
            Self::Ended(ended) => ended.fields().frame(code::ENDED, sequence_number),
        }
    }

    /// What a frame from the firmware means. A greeting of another protocol version is
    /// [`LightProtocolError::VersionMismatch`].
    pub fn from_frame(frame: &Frame) -> Result<Self, LightProtocolError> {
        match frame.kind() {
            code::HELLO => Hello::read(frame).map(Self::Hello),
            code::BOOT => Hello::read(frame).map(Self::Boot),
            code::ACK => Ack::read(frame).map(Self::Ack),
            code::NAK => Refusal::read(frame).map(Self::Nak),
            code::STEP => StepReport::read(frame).map(Self::Step),
            code::ENDED => Ended::read(frame).map(Self::Ended),
            kind => Err(LightProtocolError::UnknownKind { kind }),
        }
    }
}

impl Hello {
    fn fields(&self) -> FieldWriter {
        FieldWriter::new()
            .u8(PROTOCOL_VERSION)
            .bytes(&FIRMWARE_ID)
            .bytes(&self.firmware_version)
            .u8(self.reset_cause.0)
            .u8(self.panels)
            .u8(self.triggers)
            .u8(self.max_steps)
            .u8(self.duty_percent)
            .u16(self.watchdog_millis)
            .u16(self.max_set_millis)
            .u32(self.max_step_micros)
            .u32(self.at.0)
    }

    fn read(frame: &Frame) -> Result<Self, LightProtocolError> {
        check_identity(frame)?;
        let mut fields = FieldReader::new(frame, HELLO_BYTES)?;
        let [_protocol, _id @ ..]: [u8; 5] = fields.array();
        Ok(Self {
            firmware_version: fields.array(),
            reset_cause: ResetCause(fields.u8()),
            panels: fields.u8(),
            triggers: fields.u8(),
            max_steps: fields.u8(),
            duty_percent: fields.u8(),
            watchdog_millis: fields.u16(),
            max_set_millis: fields.u16(),
            max_step_micros: fields.u32(),
            at: BoardTime(fields.u32()),
        })
    }
}

/// Before anything else, because a firmware of another version may say more or less after it.
fn check_identity(frame: &Frame) -> Result<(), LightProtocolError> {
    let Some([firmware, id @ .., major, minor, patch]) = frame.payload().first_chunk::<HELLO_FIXED_BYTES>() else {
        return Err(LightProtocolError::BadLength {
            kind: frame.kind(),
            length: frame.payload().len(),
            expected: HELLO_BYTES,
        });
    };
    if *id != FIRMWARE_ID {
        return Err(LightProtocolError::WrongFirmware { id: *id });
    }
    if *firmware != PROTOCOL_VERSION {
        return Err(LightProtocolError::VersionMismatch {
            host: PROTOCOL_VERSION,
            firmware: *firmware,
            firmware_version: [*major, *minor, *patch],
        });
    }
    Ok(())
}

impl Ack {
    fn fields(self) -> FieldWriter {
        FieldWriter::new()
            .u8(self.command.code())
            .u32(self.at.0)
            .u8(self.lit.bits())
    }

    fn read(frame: &Frame) -> Result<Self, LightProtocolError> {
        let mut fields = FieldReader::new(frame, 6)?;
        Ok(Self {
            command: command_kind(fields.u8())?,
            at: BoardTime(fields.u32()),
            lit: Panels::from_bits(fields.u8())?,
        })
    }
}

impl StepReport {
    fn fields(&self) -> FieldWriter {
        FieldWriter::new()
            .u8(self.index)
            .u8(self.panels.bits())
            .u8(self.triggers.bits())
            .u32(self.on_at.0)
            .u32(self.trigger_at.map_or(0, |at| at.0))
            .u32(self.off_at.0)
    }

    fn read(frame: &Frame) -> Result<Self, LightProtocolError> {
        let mut fields = FieldReader::new(frame, 15)?;
        let index = fields.u8();
        let panels = Panels::from_bits(fields.u8())?;
        let triggers = Triggers::from_bits(fields.u8())?;
        let [on_at, trigger_at, off_at] = core::array::from_fn(|_| BoardTime(fields.u32()));
        Ok(Self {
            index,
            panels,
            triggers,
            on_at,
            trigger_at: (triggers != Triggers::NONE).then_some(trigger_at),
            off_at,
        })
    }
}

impl Ended {
    fn fields(self) -> FieldWriter {
        FieldWriter::new()
            .u8(self.command.code())
            .u8(self.reason as u8)
            .u8(self.steps_done)
            .u32(self.at.0)
    }

    fn read(frame: &Frame) -> Result<Self, LightProtocolError> {
        let mut fields = FieldReader::new(frame, 7)?;
        let (command, reason) = (command_kind(fields.u8())?, fields.u8());
        let known = EndReason::ALL.into_iter().find(|known| *known as u8 == reason);
        Ok(Self {
            command,
            reason: known.ok_or_else(|| bad_field("the reason of an end", reason, "0 to 4"))?,
            steps_done: fields.u8(),
            at: BoardTime(fields.u32()),
        })
    }
}

fn command_kind(code: u8) -> Result<CommandKind, LightProtocolError> {
    CommandKind::from_code(code).ok_or_else(|| bad_field("a command's code", code, "1 to 5"))
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn another_version_is_an_error_that_names_both() {
        let frame = Frame::from_parts(code::HELLO, 1, b"\x03RKLT\x02\x05\x01 and what it says more");
        let error = Message::from_frame(&frame).expect_err("protocol 3");
        assert_eq!(
            error.to_string(),
            "this host speaks light protocol 1, the controller's firmware 2.5.1 speaks 3: upload the firmware in \
             crates/light_protocol/firmware"
        );
    }

    #[test]
    fn another_device_is_an_error_that_names_it() {
        let frame = Frame::from_parts(code::HELLO, 1, b"\x01LAMP\x01\x00\x00");
        let error = Message::from_frame(&frame).expect_err("not ours");
        assert_eq!(
            error.to_string(),
            "the device calls itself \"LAMP\", the light controller calls itself \"RKLT\""
        );
    }
}
