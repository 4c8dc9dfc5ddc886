//! Record framing of MCAP: an opcode, a length of 8 bytes, then the body.

use mcap::records::op;

/// Bytes before a record's body.
pub(crate) const HEADER_BYTES: usize = 9;

/// The end of a file without a summary: data end and footer that point nowhere and have no CRC, then the magic.
pub(crate) const EMPTY_END: [u8; 13 + 29 + 8] = empty_end();

const fn empty_end() -> [u8; 13 + 29 + 8] {
    let mut end = [0; 13 + 29 + 8];
    (end[0], end[1]) = (op::DATA_END, 4);
    (end[13], end[14]) = (op::FOOTER, 8 + 8 + 4);
    let mut at = 0;
    while at < mcap::MAGIC.len() {
        end[42 + at] = mcap::MAGIC[at];
        at += 1;
    }
    end
}

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
