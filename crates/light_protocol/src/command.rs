use core::fmt;

use crate::fields::{FieldReader, FieldWriter};
use crate::frame::Frame;
use crate::{LightProtocolError, MAX_SET_MILLIS, PROTOCOL_VERSION, Panels, Sequence};

/// Which command, without its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandKind {
    /// Greets, and turns the lights off.
    Hello,
    /// Turns the lights off, ends whatever runs.
    Off,
    /// Lights panels by hand.
    Set,
    /// Runs a sequence.
    Sequence,
    /// Keeps the watchdog quiet, asks for the time.
    Ping,
}

impl CommandKind {
    const ALL: [Self; 5] = [Self::Hello, Self::Off, Self::Set, Self::Sequence, Self::Ping];

    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::Hello => 0x01,
            Self::Off => 0x02,
            Self::Set => 0x03,
            Self::Sequence => 0x04,
            Self::Ping => 0x05,
        }
    }

    pub(crate) fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.code() == code)
    }
}

impl fmt::Display for CommandKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Hello => "HELLO",
            Self::Off => "OFF",
            Self::Set => "SET",
            Self::Sequence => "SEQ",
            Self::Ping => "PING",
        })
    }
}

/// What the host asks of the firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(
    clippy::large_enum_variant,
    reason = "no heap here, and commands are few and short-lived"
)]
pub enum Command {
    /// The first thing after opening the port and after every reset of the board.
    Hello {
        /// The sender's protocol version; see [`Command::HELLO`].
        protocol: u8,
    },
    /// All panels off, at once.
    Off,
    /// Panels on, and off again by themselves.
    Set {
        /// These on, the others off.
        panels: Panels,
        /// Milliseconds, 1 to [`MAX_SET_MILLIS`]. Frames must keep coming meanwhile, or the watchdog acts.
        on_millis: u16,
    },
    /// A capture's light.
    Sequence(Sequence),
    /// Nothing but an ACK with the board's time.
    Ping,
}

impl Command {
    /// The greeting of this crate's protocol version.
    pub const HELLO: Self = Self::Hello {
        protocol: PROTOCOL_VERSION,
    };

    /// A SET within its range.
    pub fn set(panels: Panels, on_millis: u16) -> Result<Self, LightProtocolError> {
        if !(1..=MAX_SET_MILLIS).contains(&on_millis) {
            return Err(LightProtocolError::BadField {
                field: "a SET's on-time in milliseconds",
                value: on_millis.into(),
                allowed: "1 to 60000",
            });
        }
        Ok(Self::Set { panels, on_millis })
    }

    /// Without its parameters.
    pub const fn kind(&self) -> CommandKind {
        match self {
            Self::Hello { .. } => CommandKind::Hello,
            Self::Off => CommandKind::Off,
            Self::Set { .. } => CommandKind::Set,
            Self::Sequence(_) => CommandKind::Sequence,
            Self::Ping => CommandKind::Ping,
        }
    }

    /// The frame that carries it.
    pub fn to_frame(&self, sequence_number: u8) -> Frame {
        let kind = self.kind().code();
        let fields = FieldWriter::new();
        match self {
            Self::Hello { protocol } => fields.u8(*protocol).frame(kind, sequence_number),
            Self::Off | Self::Ping => fields.frame(kind, sequence_number),
            Self::Set { panels, on_millis } => fields.u8(panels.bits()).u16(*on_millis).frame(kind, sequence_number),
            Self::Sequence(sequence) => sequence.frame(kind, sequence_number),
        }
    }

    /// What a frame from the host means; what the firmware would refuse is an error.
    pub fn from_frame(frame: &Frame) -> Result<Self, LightProtocolError> {
        let unknown = LightProtocolError::UnknownKind { kind: frame.kind() };
        match CommandKind::from_code(frame.kind()).ok_or(unknown)? {
            CommandKind::Hello => FieldReader::new(frame, 1).map(|mut fields| Self::Hello { protocol: fields.u8() }),
            CommandKind::Off => FieldReader::new(frame, 0).map(|_| Self::Off),
            CommandKind::Ping => FieldReader::new(frame, 0).map(|_| Self::Ping),
            CommandKind::Set => {
                let mut fields = FieldReader::new(frame, 3)?;
                Self::set(Panels::from_bits(fields.u8())?, fields.u16())
            }
            CommandKind::Sequence => Sequence::from_frame(frame).map(Self::Sequence),
        }
    }
}
