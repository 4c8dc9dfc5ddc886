//! Unpacking chunks, whole or cut off.

use std::io::Read;

use bytes::Bytes;
use mcap::records::{ChunkHeader, Record, op};

/// A chunk that claims to unpack to more is taken for damage rather than for memory.
const MAX_CHUNK_BYTES: u64 = 1 << 31;

/// What a chunk's bytes gave.
pub(crate) enum Unpacked {
    /// Complete and, where the writer left a CRC, proven.
    Whole(Bytes),
    /// The beginning of a chunk whose end is missing; the records in it are good, as far as anybody can tell.
    Beginning(Bytes),
    /// Nothing in it can be trusted.
    Damaged(String),
    /// Packed by a method this crate does not know.
    UnknownCompression(String),
}

/// Unpacks a chunk record's body; `cut_off` says that the file ended within it.
pub(crate) fn unpack(mut body: Vec<u8>, cut_off: bool) -> Unpacked {
    let Some((header, start)) = chunk_header(&mut body, cut_off) else {
        if cut_off {
            return Unpacked::Beginning(Bytes::new());
        }
        return Unpacked::Damaged("chunk header cannot be read".to_owned());
    };
    // Some writers fill the size in when the chunk is complete.
    let size_unknown = cut_off && header.uncompressed_size == u64::MAX;
    if header.uncompressed_size > MAX_CHUNK_BYTES && !size_unknown {
        let claimed = header.uncompressed_size;
        return Unpacked::Damaged(format!(
            "chunk claims to unpack to {claimed} bytes, allowed are {MAX_CHUNK_BYTES}"
        ));
    }
    let unpacked = match header.compression.as_str() {
        "" => Ok(Bytes::from(body).slice(start..)),
        "zstd" => unpack_zstd(&body[start..], header.uncompressed_size.min(MAX_CHUNK_BYTES), cut_off),
        other => return Unpacked::UnknownCompression(other.to_owned()),
    };
    match unpacked {
        Err(reason) => Unpacked::Damaged(reason),
        Ok(data) if cut_off => Unpacked::Beginning(data),
        Ok(data) => prove(&header, data),
    }
}

/// Parses the header and drops what follows the chunk's data; gives the position of the data.
fn chunk_header(body: &mut Vec<u8>, cut_off: bool) -> Option<(ChunkHeader, usize)> {
    let available = body.len();
    // The parser insists on complete data; a cut-off chunk states a size that is not there, so it reads it padded.
    let (header, data_length) = if cut_off { parse_cut_off(body)? } else { parse(body)? };
    let overhead = 8 + 8 + 8 + 4 + 4 + header.compression.len() + 8;
    body.truncate((overhead + data_length).min(available));
    (overhead <= available).then_some((header, overhead))
}

fn parse(body: &[u8]) -> Option<(ChunkHeader, usize)> {
    match mcap::parse_record(op::CHUNK, body) {
        Ok(Record::Chunk { header, data }) => Some((header, data.len())),
        _ => None,
    }
}

/// The header of a cut-off chunk, by stating in a copy of it that no data follows.
fn parse_cut_off(body: &[u8]) -> Option<(ChunkHeader, usize)> {
    const NAME_LENGTH_AT: usize = 8 + 8 + 8 + 4;
    let name_length = u32::from_le_bytes(*body.get(NAME_LENGTH_AT..)?.first_chunk()?) as usize;
    let size_at = NAME_LENGTH_AT.checked_add(4)?.checked_add(name_length)?;
    let mut start = body.get(..size_at.checked_add(8)?)?.to_vec();
    start[size_at..].fill(0);
    let (header, _) = parse(&start)?;
    Some((header, body.len() - start.len()))
}

fn unpack_zstd(packed: &[u8], size: u64, cut_off: bool) -> Result<Bytes, String> {
    let mut data = Vec::new();
    let decoder = zstd::stream::read::Decoder::with_buffer(packed).map_err(|error| error.to_string())?;
    match decoder.take(size).read_to_end(&mut data) {
        // What came out before the input ended is a prefix of the chunk.
        Err(error) if !cut_off => Err(format!("chunk cannot be unpacked: {error}")),
        _ => Ok(data.into()),
    }
}

fn prove(header: &ChunkHeader, data: Bytes) -> Unpacked {
    let (expected, got) = (header.uncompressed_size, data.len());
    if expected != got as u64 {
        return Unpacked::Damaged(format!("chunk unpacks to {got} bytes, its header says {expected}"));
    }
    let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&data));
    // Zero means that the writer calculated none.
    if saved != 0 && saved != calculated {
        return Unpacked::Damaged(format!("chunk CRC is {calculated:08x}, its header says {saved:08x}"));
    }
    Unpacked::Whole(data)
}
