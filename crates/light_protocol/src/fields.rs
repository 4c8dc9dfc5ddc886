//! Little-endian fields, one after another.

use crate::LightProtocolError;
use crate::frame::{Frame, MAX_PAYLOAD};

/// Writes a payload's fields. The longest payload fits; writing more is a bug of this crate.
pub(crate) struct FieldWriter {
    bytes: [u8; MAX_PAYLOAD],
    length: usize,
}

impl FieldWriter {
    pub(crate) const fn new() -> Self {
        Self {
            bytes: [0; MAX_PAYLOAD],
            length: 0,
        }
    }

    pub(crate) fn bytes(mut self, values: &[u8]) -> Self {
        let end = self.length + values.len();
        self.bytes[self.length..end].copy_from_slice(values);
        self.length = end;
        self
    }

    pub(crate) fn u8(self, value: u8) -> Self {
        self.bytes(&[value])
    }

    pub(crate) fn u16(self, value: u16) -> Self {
        self.bytes(&value.to_le_bytes())
    }

    pub(crate) fn u32(self, value: u32) -> Self {
        self.bytes(&value.to_le_bytes())
    }

    pub(crate) fn frame(self, kind: u8, sequence_number: u8) -> Frame {
        Frame::from_parts(kind, sequence_number, &self.bytes[..self.length])
    }
}

/// Reads fields of a payload whose length has been checked; behind the end it reads zeros.
pub(crate) struct FieldReader<'a> {
    bytes: &'a [u8],
}

impl<'a> FieldReader<'a> {
    /// Of a frame whose payload must have `expected` bytes.
    pub(crate) fn new(frame: &'a Frame, expected: usize) -> Result<Self, LightProtocolError> {
        let length = frame.payload().len();
        if length != expected {
            return Err(LightProtocolError::BadLength {
                kind: frame.kind(),
                length,
                expected,
            });
        }
        Ok(Self { bytes: frame.payload() })
    }

    pub(crate) fn array<const N: usize>(&mut self) -> [u8; N] {
        let Some((first, rest)) = self.bytes.split_first_chunk() else {
            return [0; N];
        };
        self.bytes = rest;
        *first
    }

    pub(crate) fn u8(&mut self) -> u8 {
        u8::from_le_bytes(self.array())
    }

    pub(crate) fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.array())
    }

    pub(crate) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }
}
