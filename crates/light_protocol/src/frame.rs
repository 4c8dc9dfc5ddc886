//! Bodies to bytes on the line and back.

use core::fmt;
use core::ops::Deref;

use crate::LightProtocolError;
use crate::sequence::{MAX_STEPS, SEQUENCE_HEADER_BYTES, STEP_BYTES};

/// Longest payload, bytes: a SEQ of sixteen steps.
pub const MAX_PAYLOAD: usize = SEQUENCE_HEADER_BYTES + MAX_STEPS * STEP_BYTES;
const HEADER_BYTES: usize = 2;
const CRC_BYTES: usize = 2;
const MIN_BODY: usize = HEADER_BYTES + CRC_BYTES;
const MAX_BODY: usize = MIN_BODY + MAX_PAYLOAD;
// One code byte: a body is shorter than the 254 bytes after which COBS needs another.
const MAX_ENCODED: usize = MAX_BODY + 1;
/// Longest frame on the line, bytes, both delimiters included.
pub const MAX_FRAME: usize = MAX_ENCODED + 2;
const DELIMITER: u8 = 0;

fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| {
            if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 }
        })
    })
}

/// A frame's content, not yet interpreted.
#[derive(Clone, PartialEq, Eq)]
pub struct Frame {
    kind: u8,
    sequence_number: u8,
    payload: [u8; MAX_PAYLOAD],
    payload_length: usize,
}

impl Frame {
    /// Of any kind; the payload has at most [`MAX_PAYLOAD`] bytes.
    pub fn new(kind: u8, sequence_number: u8, payload: &[u8]) -> Result<Self, LightProtocolError> {
        if payload.len() > MAX_PAYLOAD {
            return Err(LightProtocolError::TooLong { most: MAX_PAYLOAD });
        }
        Ok(Self::from_parts(kind, sequence_number, payload))
    }

    pub(crate) fn from_parts(kind: u8, sequence_number: u8, payload: &[u8]) -> Self {
        let mut frame = Self {
            kind,
            sequence_number,
            payload: [0; MAX_PAYLOAD],
            payload_length: payload.len(),
        };
        frame.payload[..payload.len()].copy_from_slice(payload);
        frame
    }

    /// What the payload means; see the table in the crate's documentation.
    pub fn kind(&self) -> u8 {
        self.kind
    }

    /// Joins replies and events to commands.
    pub fn sequence_number(&self) -> u8 {
        self.sequence_number
    }

    /// Between the sequence number and the CRC.
    pub fn payload(&self) -> &[u8] {
        &self.payload[..self.payload_length]
    }

    /// The bytes for the line, delimiters included.
    pub fn encode(&self) -> Packet {
        let mut body = [0; MAX_BODY];
        let checked = HEADER_BYTES + self.payload_length;
        body[0] = self.kind;
        body[1] = self.sequence_number;
        body[HEADER_BYTES..checked].copy_from_slice(self.payload());
        let crc = crc16(&body[..checked]);
        body[checked..checked + CRC_BYTES].copy_from_slice(&crc.to_le_bytes());

        let mut packet = Packet::empty();
        packet.push(DELIMITER);
        for run in body[..checked + CRC_BYTES].split(|byte| *byte == 0) {
            packet.push(run.len() as u8 + 1);
            for byte in run {
                packet.push(*byte);
            }
        }
        packet.push(DELIMITER);
        packet
    }

    fn from_body(body: &[u8]) -> Result<Self, LightProtocolError> {
        let short = LightProtocolError::TooShort {
            length: body.len(),
            least: MIN_BODY,
        };
        let (checked, crc) = body.split_last_chunk().ok_or(short)?;
        let [kind, sequence_number, payload @ ..] = checked else {
            return Err(short);
        };
        let (computed, received) = (crc16(checked), u16::from_le_bytes(*crc));
        if computed != received {
            return Err(LightProtocolError::BadCrc { computed, received });
        }
        Self::new(*kind, *sequence_number, payload)
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Frame")
            .field("kind", &self.kind)
            .field("sequence_number", &self.sequence_number)
            .field("payload", &self.payload())
            .finish_non_exhaustive()
    }
}

/// The bytes of one frame, ready to be written; a slice by `Deref`.
#[derive(Clone, PartialEq, Eq)]
pub struct Packet {
    bytes: [u8; MAX_FRAME],
    length: usize,
}

impl Packet {
    const fn empty() -> Self {
        Self {
            bytes: [0; MAX_FRAME],
            length: 0,
        }
    }

    fn push(&mut self, byte: u8) {
        self.bytes[self.length] = byte;
        self.length += 1;
    }
}

impl Deref for Packet {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

impl fmt::Debug for Packet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.deref().fmt(formatter)
    }
}

/// Finds frames in a stream of bytes, however it is split; after garbage it is right again at the next delimiter.
#[derive(Debug, Clone)]
pub struct FrameDecoder {
    encoded: [u8; MAX_ENCODED],
    length: usize,
    too_long: bool,
}

impl Default for FrameDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl FrameDecoder {
    /// At the start of a stream.
    pub const fn new() -> Self {
        Self {
            encoded: [0; MAX_ENCODED],
            length: 0,
            too_long: false,
        }
    }

    /// Takes the stream's next byte. A delimiter that ends a frame, or what should have been one, gives a result.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame, LightProtocolError>> {
        if byte == DELIMITER {
            return self.end();
        }
        match self.encoded.get_mut(self.length) {
            Some(free) => {
                *free = byte;
                self.length += 1;
            }
            None => self.too_long = true,
        }
        None
    }

    fn end(&mut self) -> Option<Result<Frame, LightProtocolError>> {
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.too_long) {
            return Some(Err(LightProtocolError::TooLong { most: MAX_ENCODED }));
        }
        (length > 0).then(|| {
            let mut body = [0; MAX_ENCODED];
            let body = unstuff(&self.encoded[..length], &mut body)?;
            Frame::from_body(body)
        })
    }
}

/// Undoes COBS: each code byte says how far away the next zero is.
fn unstuff<'a>(encoded: &[u8], body: &'a mut [u8; MAX_ENCODED]) -> Result<&'a [u8], LightProtocolError> {
    let bad = LightProtocolError::BadEncoding { length: encoded.len() };
    let (mut rest, mut end) = (encoded, 0);
    while let Some((code, after)) = rest.split_first() {
        let run_length = usize::from(*code).checked_sub(1).ok_or(bad)?;
        let (run, after) = after.split_at_checked(run_length).ok_or(bad)?;
        body[end..end + run.len()].copy_from_slice(run);
        end += run.len();
        if !after.is_empty() {
            body[end] = 0;
            end += 1;
        }
        rest = after;
    }
    Ok(&body[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crc_has_its_published_check_value() {
        assert_eq!(crc16(b"123456789"), 0x29B1);
    }

    #[test]
    fn a_frame_behind_a_broken_one_is_found() {
        let frame = Frame::from_parts(5, 7, &[0, 0, 1]);
        let mut decoder = FrameDecoder::new();
        let mut broken = frame.encode();
        broken.bytes[3] ^= 0x10;
        let mut last = |bytes: &[u8]| bytes.iter().filter_map(|byte| decoder.push(*byte)).last();
        assert!(matches!(last(&broken), Some(Err(LightProtocolError::BadCrc { .. }))));
        assert_eq!(last(&frame.encode()), Some(Ok(frame)));
    }

    #[test]
    fn what_is_longer_than_any_frame_is_named_and_skipped() {
        let mut decoder = FrameDecoder::new();
        assert!((0..1000).all(|_| decoder.push(7).is_none()));
        assert_eq!(
            decoder.push(0),
            Some(Err(LightProtocolError::TooLong { most: MAX_ENCODED }))
        );
        assert_eq!(decoder.push(0), None);
    }
}
