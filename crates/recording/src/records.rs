//! Record framing of MCAP: an opcode, a length of 8 bytes, then the body.

/// Bytes before a record's body.
pub(crate) const HEADER_BYTES: usize = 9;

/// A record's opcode and the length of its body.
pub(crate) fn record_header(bytes: [u8; HEADER_BYTES]) -> (u8, u64) {
    let [opcode, length @ ..] = bytes;
    (opcode, u64::from_le_bytes(length))
}

/// A record inside an unpacked chunk.
pub(crate) struct InnerRecord<'a> {
    pub(crate) opcode: u8,
    /// Where the body begins in the chunk.
    pub(crate) start: usize,
    pub(crate) body: &'a [u8],
}

/// The complete records of an unpacked chunk, and whether bytes were left over.
pub(crate) struct InnerRecords<'a> {
    data: &'a [u8],
    position: usize,
}

impl<'a> InnerRecords<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self { data, position: 0 }
    }

    /// True once every byte has been part of a record.
    pub(crate) fn is_exhausted(&self) -> bool {
        self.position == self.data.len()
    }
}

impl<'a> Iterator for InnerRecords<'a> {
    type Item = InnerRecord<'a>;

    fn next(&mut self) -> Option<InnerRecord<'a>> {
        let (header, rest) = self.data[self.position..].split_first_chunk()?;
        let (opcode, length) = record_header(*header);
        let body = rest.get(..usize::try_from(length).ok()?)?;
        let start = self.position + HEADER_BYTES;
        self.position = start + body.len();
        Some(InnerRecord { opcode, start, body })
    }
}
