//! What can go wrong, by cause.

use std::net::SocketAddrV4;

/// Why a packet, an image or a configuration is refused, with what was found and what is allowed.
#[derive(Debug, thiserror::Error)]
pub enum GigeVisionError {
    /// A packet ends before its content does.
    #[error("{what} needs {needed} bytes, {found} are there")]
    Truncated {
        /// What was being read.
        what: &'static str,
        /// Bytes there.
        found: usize,
        /// Bytes needed.
        needed: usize,
    },
    /// A packet's body has a length that its kind does not have.
    #[error("{what} has a body of {found} bytes; allowed: {allowed}")]
    BodyLength {
        /// Kind of packet.
        what: &'static str,
        /// Bytes of body.
        found: usize,
        /// In words.
        allowed: &'static str,
    },
    /// The first byte is not that of a GVCP command.
    #[error("a GVCP command begins with 0x42, this datagram with {found:#04x}")]
    NotGvcp {
        /// First byte.
        found: u8,
    },
    /// The first byte is not that of a GVCP answer.
    #[error("a GVCP answer begins with 0x00 or 0x80, this datagram with {found:#04x}")]
    NotAnAnswer {
        /// First byte.
        found: u8,
    },
    /// A GVCP command this crate does not know.
    #[error("GVCP command {command:#06x} (request {id}) is not implemented")]
    UnknownCommand {
        /// Command code.
        command: u16,
        /// Request id, for the answer.
        id: u16,
        /// Whether an answer is wanted.
        acknowledge: bool,
    },
    /// A GVCP command whose body makes no sense.
    #[error("GVCP request {id}: {reason}")]
    Command {
        /// Command code.
        command: u16,
        /// Request id, for the answer.
        id: u16,
        /// Whether an answer is wanted.
        acknowledge: bool,
        /// What is wrong with the body.
        reason: Box<GigeVisionError>,
    },
    /// A GVSP packet that is neither leader, payload nor trailer.
    #[error("GVSP content type {found:#04x}; known are 1 (leader), 2 (trailer), 3 (payload)")]
    UnknownContent {
        /// Content type.
        found: u8,
    },
    /// A stream of something other than images.
    #[error("GVSP payload type {found}; only images (1) are understood")]
    PayloadType {
        /// As announced.
        found: u32,
    },
    /// A pixel format this crate does not know.
    #[error("pixel format {found:#010x}; known are Mono8, Mono12 and Mono16")]
    PixelFormat {
        /// Code on the wire.
        found: u32,
    },
    /// The frame source gave an image of the wrong size; nothing was sent.
    #[error("the frame source gave {found} bytes, the region of interest needs {needed}")]
    ImageSize {
        /// Bytes given.
        found: usize,
        /// Bytes needed.
        needed: usize,
    },
    /// The image belongs to an acquisition that has ended; nothing was sent.
    #[error("the acquisition this image was taken for has ended")]
    Stale,
    /// A name does not fit its register.
    #[error("{field} {value:?} has {} bytes; its register holds ASCII of 1 to {allowed}", value.len())]
    Name {
        /// Which name.
        field: &'static str,
        /// As given.
        value: String,
        /// Most bytes.
        allowed: usize,
    },
    /// A sensor this crate cannot stream.
    #[error("a sensor of {width} x {height} pixels; allowed are multiples of 4 from 16 to 8192 on both sides")]
    SensorSize {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The address cannot be served.
    #[error("cannot serve {address}: {source}")]
    Bind {
        /// Address and port.
        address: SocketAddrV4,
        /// The system's reason.
        source: std::io::Error,
    },
}
