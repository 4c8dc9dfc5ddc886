//! The wire form: CDR (XCDR version 1) with its four-byte encapsulation header, as every ROS 2 middleware and bag uses.

use std::io;

use byteorder::{BigEndian, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::Message;

/// The encapsulation header of little-endian CDR: representation 1, no options.
pub const LITTLE_ENDIAN_HEADER: [u8; 4] = [0, 1, 0, 0];

/// The longest message in bytes: lengths on the wire have 32 bits.
pub const MAX_BYTES: usize = u32::MAX as usize;

/// How many bytes behind a message of `used` bytes may be ignored.
///
/// Writers pad to a multiple of four. rclpy's `serialize_message`, and so every bag written with it, appends much more:
/// it keeps the size that was estimated, which counts up to four bytes of alignment after the four-byte length of each
/// empty sequence of 8-byte elements. That is never more than the message itself; what is longer held another type.
fn allowed_left_over(used: usize) -> usize {
    used.max(3)
}

/// Why a message could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A value cannot be written, for example because it exceeds a bound of its interface file.
    #[error("cannot serialise {type_name}: {reason}")]
    Serialize {
        /// The message's full ROS name.
        type_name: &'static str,
        /// What is wrong.
        reason: cdr_encoding::Error,
    },
    /// A message is longer than the wire form can say.
    #[error("cannot serialise {type_name}: it has {length} bytes; allowed: at most {MAX_BYTES}")]
    TooLong {
        /// The message's full ROS name.
        type_name: &'static str,
        /// Its length in bytes.
        length: usize,
    },
    /// The bytes do not hold such a message.
    #[error("cannot deserialise {type_name} from {length} bytes: {reason}")]
    Deserialize {
        /// The message's full ROS name.
        type_name: &'static str,
        /// How many bytes there are.
        length: usize,
        /// What is wrong.
        reason: cdr_encoding::Error,
    },
    /// There are not even the bytes of a header.
    #[error("cannot deserialise {type_name}: {length} bytes; allowed: at least the 4 of the encapsulation header")]
    NoHeader {
        /// The message's full ROS name.
        type_name: &'static str,
        /// How many bytes there are.
        length: usize,
    },
    /// The header names another representation.
    #[error(
        "cannot deserialise {type_name}: encapsulation {found:#06x}; allowed: 0x0000 (big-endian CDR) or 0x0001 \
         (little-endian CDR)"
    )]
    Encapsulation {
        /// The message's full ROS name.
        type_name: &'static str,
        /// The header's representation identifier.
        found: u16,
    },
    /// Bytes are left over, so they held another type.
    #[error("cannot deserialise {type_name}: {left_over} of {length} bytes are left over; allowed: at most {allowed}")]
    LeftOver {
        /// The message's full ROS name.
        type_name: &'static str,
        /// How many bytes there are.
        length: usize,
        /// How many were not used.
        left_over: usize,
        /// How many may be unused.
        allowed: usize,
    },
}

/// The result of reading or writing CDR.
pub type Result<T> = std::result::Result<T, Error>;

/// The order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Endianness {
    /// Lowest byte first: what this crate writes.
    Little,
    /// Highest byte first.
    Big,
}

/// Writes the encapsulation header and the body, little-endian. Allocates once, of exactly the right size.
pub fn to_vec<M: Message>(message: &M) -> Result<Vec<u8>> {
    write(message, M::TYPE_NAME, &LITTLE_ENDIAN_HEADER)
}

/// Writes the body alone, little-endian, for callers that write the header themselves.
///
/// Takes any type, because middleware wraps messages into structures of its own; errors then carry its Rust name.
pub fn to_body<T: Serialize>(value: &T) -> Result<Vec<u8>> {
    write(value, std::any::type_name::<T>(), &[])
}

/// Reads a header of either endianness and the body behind it.
pub fn from_slice<M: Message>(bytes: &[u8]) -> Result<M> {
    let (type_name, length) = (M::TYPE_NAME, bytes.len());
    let Some((header, body)) = bytes.split_first_chunk::<4>() else {
        return Err(Error::NoHeader { type_name, length });
    };
    match u16::from_be_bytes([header[0], header[1]]) {
        0 => read(body, Endianness::Big, type_name),
        1 => read(body, Endianness::Little, type_name),
        found => Err(Error::Encapsulation { type_name, found }),
    }
}

/// Reads a body without header. Errors carry the type's Rust name.
pub fn from_body<T: DeserializeOwned>(body: &[u8], endianness: Endianness) -> Result<T> {
    read(body, endianness, std::any::type_name::<T>())
}

fn write<T: Serialize>(value: &T, type_name: &'static str, header: &[u8]) -> Result<Vec<u8>> {
    let failed = |reason| Error::Serialize { type_name, reason };
    let mut size = ByteCounter(header.len());
    cdr_encoding::to_writer::<T, LittleEndian, _>(&mut size, value).map_err(failed)?;
    if size.0 > MAX_BYTES {
        return Err(Error::TooLong {
            type_name,
            length: size.0,
        });
    }
    let mut bytes = Vec::with_capacity(size.0);
    bytes.extend_from_slice(header);
    cdr_encoding::to_writer::<T, LittleEndian, _>(&mut bytes, value).map_err(failed)?;
    Ok(bytes)
}

fn read<T: DeserializeOwned>(body: &[u8], endianness: Endianness, type_name: &'static str) -> Result<T> {
    let length = body.len();
    let (value, used) = match endianness {
        Endianness::Little => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        Endianness::Big => cdr_encoding::from_bytes::<T, BigEndian>(body),
    }
    .map_err(|reason| Error::Deserialize {
        type_name,
        length,
        reason,
    })?;
    let left_over = length - used;
    let allowed = allowed_left_over(used);
    if left_over > allowed {
        return Err(Error::LeftOver {
            type_name,
            length,
            left_over,
            allowed,
        });
    }
    Ok(value)
}

/// Counts what would be written.
struct ByteCounter(usize);

impl io::Write for ByteCounter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
