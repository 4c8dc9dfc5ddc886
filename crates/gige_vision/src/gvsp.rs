//! The stream protocol (GVSP): one leader, payload packets and one trailer per frame, standard 16-bit block ids.

use crate::wire::Reader;
use crate::{GigeVisionError, PixelFormat};

/// IP and UDP headers, which the negotiated packet size includes.
pub const IP_UDP_BYTES: usize = 28;
/// Header of every stream packet.
pub const HEADER_BYTES: usize = 8;
/// Status of a packet sent for the first time.
pub const STATUS_OK: u16 = 0;
/// Status of a packet sent again.
pub const STATUS_RESENT: u16 = 0x0100;
/// Status of a packet that was asked for again and is gone.
pub const STATUS_UNAVAILABLE: u16 = 0x800c;

const LEADER: u8 = 1;
const TRAILER: u8 = 2;
const PAYLOAD: u8 = 3;
const PAYLOAD_IMAGE: u16 = 1;

/// What a frame's first packet announces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leader {
    /// Start of exposure, nanoseconds of the device's clock.
    pub timestamp_nanos: u64,
    /// Format of the payload.
    pub pixel_format: PixelFormat,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// First column on the (binned) sensor.
    pub offset_x: u32,
    /// First row on the (binned) sensor.
    pub offset_y: u32,
}

/// What a stream packet carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content<'a> {
    /// Packet 0.
    Leader(Leader),
    /// Packets 1 to N; all but the last of the same length.
    Payload(&'a [u8]),
    /// Packet N + 1.
    Trailer {
        /// Rows sent.
        height: u32,
    },
}

/// One stream packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// 0 unless something is to be said.
    pub status: u16,
    /// Frame, 1..=65535; rises by one per frame and skips 0.
    pub block_id: u16,
    /// Place in the frame, 24 bits.
    pub packet_id: u32,
    /// What it carries.
    pub content: Content<'a>,
}

impl<'a> Packet<'a> {
    /// As a datagram, in place of what `datagram` held.
    pub fn encode(&self, datagram: &mut Vec<u8>) {
        datagram.clear();
        let kind = match self.content {
            Content::Leader(_) => LEADER,
            Content::Payload(_) => PAYLOAD,
            Content::Trailer { .. } => TRAILER,
        };
        datagram.extend(self.status.to_be_bytes());
        datagram.extend(self.block_id.to_be_bytes());
        datagram.extend((u32::from(kind) << 24 | self.packet_id & 0x00ff_ffff).to_be_bytes());
        match self.content {
            Content::Leader(leader) => encode_leader(&leader, datagram),
            Content::Payload(bytes) => datagram.extend_from_slice(bytes),
            Content::Trailer { height } => {
                datagram.extend(u32::from(PAYLOAD_IMAGE).to_be_bytes());
                datagram.extend(height.to_be_bytes());
            }
        }
    }

    /// From a datagram.
    pub fn decode(datagram: &'a [u8]) -> Result<Self, GigeVisionError> {
        let mut reader = Reader::new("a GVSP packet", datagram);
        let (status, block_id, kind_and_id) = (reader.u16()?, reader.u16()?, reader.u32()?);
        let content = match (kind_and_id >> 24) as u8 {
            LEADER => Content::Leader(decode_leader(reader)?),
            PAYLOAD => Content::Payload(reader.rest()),
            TRAILER => Content::Trailer {
                height: decode_trailer(reader)?,
            },
            found => return Err(GigeVisionError::UnknownContent { found }),
        };
        Ok(Self {
            status,
            block_id,
            packet_id: kind_and_id & 0x00ff_ffff,
            content,
        })
    }
}

fn encode_leader(leader: &Leader, datagram: &mut Vec<u8>) {
    datagram.extend(0_u16.to_be_bytes());
    datagram.extend(PAYLOAD_IMAGE.to_be_bytes());
    datagram.extend(leader.timestamp_nanos.to_be_bytes());
    for word in [
        leader.pixel_format.code(),
        leader.width,
        leader.height,
        leader.offset_x,
        leader.offset_y,
        0, // no padding of rows or of the image
    ] {
        datagram.extend(word.to_be_bytes());
    }
}

fn decode_leader(mut reader: Reader<'_>) -> Result<Leader, GigeVisionError> {
    check_image(reader.u32()? & 0xffff)?;
    let leader = Leader {
        timestamp_nanos: reader.u64()?,
        pixel_format: PixelFormat::from_code(reader.u32()?)?,
        width: reader.u32()?,
        height: reader.u32()?,
        offset_x: reader.u32()?,
        offset_y: reader.u32()?,
    };
    reader.u32()?;
    Ok(leader)
}

fn decode_trailer(mut reader: Reader<'_>) -> Result<u32, GigeVisionError> {
    check_image(reader.u32()?)?;
    reader.u32()
}

fn check_image(found: u32) -> Result<(), GigeVisionError> {
    if found == u32::from(PAYLOAD_IMAGE) {
        Ok(())
    } else {
        Err(GigeVisionError::PayloadType { found })
    }
}
