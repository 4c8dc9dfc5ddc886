//! Frames on the control port.
//!
//! Two bytes transaction, two bytes protocol, two bytes length of what follows, all big endian; then the register and
//! its parameters, or in a reply the register, a status byte and data.

use crate::error::ProtocolError;

const HEADER: usize = 6;
/// Bytes after the header that a frame may have; the longest known request has some 120.
const LONGEST_BODY: usize = 1024;

/// Sent once a second by clients that have asked to be watched; never answered.
pub const HEARTBEAT: [u8; 8] = [0, 0, 0, 1, 0, 2, 0, 0];

/// What kind of frame it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Protocol {
    /// 0: standard Modbus TCP, which the same port answers.
    Modbus,
    /// 1: a heart-beat.
    Heartbeat,
    /// 2: the vendor's own.
    Private,
    /// 3: the same from a client that promises to say something every 30 s; firmware 1.8.6 and later.
    KeepAlive,
    /// Anything else.
    Other(u16),
}

impl Protocol {
    /// As in the header.
    pub fn from_number(number: u16) -> Self {
        match number {
            0 => Self::Modbus,
            1 => Self::Heartbeat,
            2 => Self::Private,
            3 => Self::KeepAlive,
            other => Self::Other(other),
        }
    }

    /// As in the header.
    pub fn number(self) -> u16 {
        match self {
            Self::Modbus => 0,
            Self::Heartbeat => 1,
            Self::Private => 2,
            Self::KeepAlive => 3,
            Self::Other(number) => number,
        }
    }
}

/// A request, a reply or feedback, not yet understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// 1 to 65535, chosen by the client and repeated in the reply.
    pub transaction: u16,
    /// What kind of frame it is.
    pub protocol: Protocol,
    /// Register first; never empty.
    pub body: Vec<u8>,
}

impl Frame {
    /// The first byte of the body.
    pub fn register(&self) -> u8 {
        self.body.first().copied().unwrap_or(0)
    }

    /// What follows the register.
    pub fn parameters(&self) -> &[u8] {
        self.body.get(1..).unwrap_or(&[])
    }

    /// Header and body.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + self.body.len());
        self.encode_into(&mut bytes);
        bytes
    }

    /// Appends header and body.
    pub fn encode_into(&self, bytes: &mut Vec<u8>) {
        put_header(bytes, self.transaction, self.protocol, self.body.len());
        bytes.extend(&self.body);
    }
}

pub(crate) fn put_header(bytes: &mut Vec<u8>, transaction: u16, protocol: Protocol, body: usize) {
    bytes.extend(transaction.to_be_bytes());
    bytes.extend(protocol.number().to_be_bytes());
    bytes.extend((body as u16).to_be_bytes());
}

/// Transaction numbers of a client: 1 to 65535, then 1 again.
#[derive(Debug, Clone, Copy, Default)]
pub struct Transactions {
    last: u16,
}

impl Transactions {
    /// The next one.
    pub fn next_number(&mut self) -> u16 {
        self.last = self.last.checked_add(1).unwrap_or(1);
        self.last
    }
}

/// Takes bytes as they come and gives whole frames.
#[derive(Debug, Clone, Default)]
pub struct FrameReader {
    bytes: Vec<u8>,
}

impl FrameReader {
    /// Bytes in the order in which they came.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    /// The next whole frame; none until more bytes come.
    ///
    /// # Errors
    /// A length that cannot be: the stream has lost its frames, and the connection has to be closed.
    #[allow(clippy::should_implement_trait, reason = "an error in the stream is no item of it")]
    pub fn next(&mut self) -> Result<Option<Frame>, ProtocolError> {
        let Some((header, rest)) = self.bytes.split_first_chunk::<HEADER>() else {
            return Ok(None);
        };
        let word = |at: usize| u16::from_be_bytes([header[at], header[at + 1]]);
        let length = usize::from(word(4));
        if !(1..=LONGEST_BODY).contains(&length) {
            return Err(ProtocolError::FrameLength {
                found: length,
                most: LONGEST_BODY,
            });
        }
        let Some(body) = rest.get(..length) else {
            return Ok(None);
        };
        let frame = Frame {
            transaction: word(0),
            protocol: Protocol::from_number(word(2)),
            body: body.to_vec(),
        };
        self.bytes.drain(..HEADER + length);
        Ok(Some(frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transactions_never_are_zero() {
        let mut transactions = Transactions { last: u16::MAX - 1 };
        assert_eq!([(); 3].map(|()| transactions.next_number()), [u16::MAX, 1, 2]);
    }

    #[test]
    fn a_length_that_cannot_be_is_an_error() {
        let mut reader = FrameReader::default();
        reader.push(&[0, 1, 0, 2, 0xFF, 0xFF, 11]);
        assert_eq!(
            reader.next(),
            Err(ProtocolError::FrameLength {
                found: 65535,
                most: LONGEST_BODY
            })
        );
    }

    #[test]
    fn the_heartbeat_is_a_frame() {
        let mut reader = FrameReader::default();
        reader.push(&HEARTBEAT);
        let frame = reader.next().expect("whole").expect("whole");
        assert_eq!(
            (frame.protocol, frame.encode()),
            (Protocol::Heartbeat, HEARTBEAT.to_vec())
        );
    }
}
