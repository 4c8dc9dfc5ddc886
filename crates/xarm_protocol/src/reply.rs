//! Answers to requests.

use crate::bytes::{Cursor, put_floats};
use crate::error::ProtocolError;
use crate::frame::{Frame, Protocol};

/// What comes with every answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Status(pub u8);

impl Status {
    /// All is well.
    pub const FINE: Self = Self(0);
    /// There is an error that nobody has cleaned.
    pub const ERROR: Self = Self(0x40);
    /// There is a warning that nobody has cleaned.
    pub const WARNING: Self = Self(0x20);
    /// A motion would not be obeyed.
    pub const NOT_READY: Self = Self(0x10);
    /// The parameters or the result are wrong.
    pub const INVALID: Self = Self(0x08);

    /// Both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of the other's bits are set.
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Of the request.
    pub register: u8,
    /// How it went.
    pub status: Status,
    /// What was asked for.
    pub data: Vec<u8>,
}

impl Reply {
    /// With floats, little endian.
    pub fn floats(register: u8, status: Status, values: &[f32]) -> Self {
        let mut data = Vec::with_capacity(4 * values.len());
        put_floats(&mut data, values);
        Self { register, status, data }
    }

    /// From a frame; what is told without being asked has register [`FEEDBACK`](crate::register::FEEDBACK).
    pub fn of_frame(frame: &Frame) -> Result<Self, ProtocolError> {
        let mut cursor = Cursor::new("reply", "2 or more", &frame.body);
        Ok(Self {
            register: cursor.u8()?,
            status: Status(cursor.u8()?),
            data: cursor.rest().to_vec(),
        })
    }

    /// To the request with this transaction and protocol.
    pub fn frame(&self, transaction: u16, protocol: Protocol) -> Frame {
        let mut body = vec![self.register, self.status.0];
        body.extend(&self.data);
        Frame {
            transaction,
            protocol,
            body,
        }
    }

    /// The first `N` floats of the data.
    pub fn read_floats<const N: usize>(&self) -> Result<[f32; N], ProtocolError> {
        Cursor::new("floats of a reply", "4 bytes for each", &self.data).floats()
    }

    /// The first `N` bytes of the data.
    pub fn read_bytes<const N: usize>(&self) -> Result<[u8; N], ProtocolError> {
        Cursor::new("bytes of a reply", "one for each value", &self.data).array()
    }

    /// A tool board's register: a big endian integer.
    pub fn read_integer(&self) -> Result<i32, ProtocolError> {
        Ok(i32::from_be_bytes(self.read_bytes()?))
    }
}
