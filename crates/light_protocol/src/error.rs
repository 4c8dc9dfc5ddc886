use core::str::from_utf8;

/// What can be wrong with a command to be sent or with bytes that came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LightProtocolError {
    /// The bytes were changed on the way.
    #[error("a frame's CRC is {computed:#06x}, it says {received:#06x}")]
    BadCrc {
        /// Over the bytes that came.
        computed: u16,
        /// At the frame's end.
        received: u16,
    },
    /// Bytes between two delimiters that no encoder makes.
    #[error("{length} bytes between two delimiters are not a COBS encoding")]
    BadEncoding {
        /// Bytes between the delimiters.
        length: usize,
    },
    /// No room for kind, sequence number and CRC.
    #[error("a frame of {length} bytes, at least {least} are needed")]
    TooShort {
        /// Bytes of the body.
        length: usize,
        /// Bytes of the shortest body.
        least: usize,
    },
    /// Longer than any frame of this protocol.
    #[error("more than {most} bytes without a delimiter")]
    TooLong {
        /// Bytes of the longest frame, encoded, without delimiters.
        most: usize,
    },
    /// A frame that this side does not expect.
    #[error("frame kind {kind:#04x} is none of this direction's")]
    UnknownKind {
        /// As received.
        kind: u8,
    },
    /// The payload does not have its kind's length.
    #[error("a payload of {length} bytes in a frame of kind {kind:#04x}, which has {expected}")]
    BadLength {
        /// The frame's kind.
        kind: u8,
        /// As received.
        length: usize,
        /// What the kind has.
        expected: usize,
    },
    /// A number that has no meaning.
    #[error("{field} is {value}, allowed is {allowed}")]
    BadField {
        /// Which field.
        field: &'static str,
        /// As received or given.
        value: u32,
        /// In words.
        allowed: &'static str,
    },
    /// Host and firmware belong to different releases.
    #[error(
        "this host speaks light protocol {host}, the controller's firmware {}.{}.{} speaks {firmware}: upload the \
         firmware in crates/light_protocol/firmware", .firmware_version[0], .firmware_version[1], .firmware_version[2]
    )]
    VersionMismatch {
        /// Protocol version of this crate.
        host: u8,
        /// Protocol version of the firmware.
        firmware: u8,
        /// The firmware's own version.
        firmware_version: [u8; 3],
    },
    /// Something else answers at this port.
    #[error(
        "the device calls itself {:?}, the light controller calls itself {:?}",
        from_utf8(.id).unwrap_or("(not text)"), from_utf8(&crate::FIRMWARE_ID).unwrap_or_default()
    )]
    WrongFirmware {
        /// As received.
        id: [u8; 4],
    },
    /// Too few or too many steps.
    #[error("a sequence of {count} steps, allowed are 1 to {most}")]
    StepCount {
        /// As given.
        count: usize,
        /// The most.
        most: usize,
    },
    /// A time of a sequence is out of its range.
    #[error("{what} of step {step} is {micros} us, allowed are {least} to {most} us")]
    StepTime {
        /// From 0.
        step: usize,
        /// Which time.
        what: &'static str,
        /// As given.
        micros: u32,
        /// The least.
        least: u32,
        /// The most.
        most: u32,
    },
}

pub(crate) fn bad_field(field: &'static str, value: u8, allowed: &'static str) -> LightProtocolError {
    LightProtocolError::BadField {
        field,
        value: value.into(),
        allowed,
    }
}
