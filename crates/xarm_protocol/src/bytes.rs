//! Numbers in bytes.

use crate::error::ProtocolError;

/// Reads front to back.
pub(crate) struct Cursor<'a> {
    what: &'static str,
    expected: &'static str,
    found: usize,
    left: &'a [u8],
}

impl<'a> Cursor<'a> {
    /// `what` and `expected` are for the error.
    pub(crate) fn new(what: &'static str, expected: &'static str, bytes: &'a [u8]) -> Self {
        Self {
            what,
            expected,
            found: bytes.len(),
            left: bytes,
        }
    }

    fn short(&self) -> ProtocolError {
        ProtocolError::Length {
            what: self.what,
            found: self.found,
            expected: self.expected,
        }
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], ProtocolError> {
        let (head, left) = self.left.split_first_chunk::<N>().ok_or_else(|| self.short())?;
        self.left = left;
        Ok(*head)
    }

    pub(crate) fn slice(&mut self, count: usize) -> Result<&'a [u8], ProtocolError> {
        let (head, left) = self.left.split_at_checked(count).ok_or_else(|| self.short())?;
        self.left = left;
        Ok(head)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, ProtocolError> {
        Ok(self.array::<1>()?[0])
    }

    pub(crate) fn flag(&mut self) -> Result<bool, ProtocolError> {
        Ok(self.u8()? != 0)
    }

    pub(crate) fn u16(&mut self) -> Result<u16, ProtocolError> {
        self.array().map(u16::from_be_bytes)
    }

    pub(crate) fn u32(&mut self) -> Result<u32, ProtocolError> {
        self.array().map(u32::from_be_bytes)
    }

    pub(crate) fn u64(&mut self) -> Result<u64, ProtocolError> {
        self.array().map(u64::from_be_bytes)
    }

    pub(crate) fn f32(&mut self) -> Result<f32, ProtocolError> {
        self.array().map(f32::from_le_bytes)
    }

    pub(crate) fn floats<const N: usize>(&mut self) -> Result<[f32; N], ProtocolError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f32()?;
        }
        Ok(values)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.left.is_empty()
    }

    pub(crate) fn remaining(&self) -> usize {
        self.left.len()
    }

    pub(crate) fn rest(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.left)
    }

    /// Refuses what is left.
    pub(crate) fn end(self) -> Result<(), ProtocolError> {
        if self.left.is_empty() {
            return Ok(());
        }
        Err(self.short())
    }
}

pub(crate) fn put_floats(bytes: &mut Vec<u8>, values: &[f32]) {
    for value in values {
        bytes.extend(value.to_le_bytes());
    }
}
