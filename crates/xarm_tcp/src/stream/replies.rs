//! Replies to set-points, out of a buffer of fixed size.

use devices::StreamFault;
use xarm_protocol::{Status, register};

/// Bytes before the register.
const HEADER: usize = 6;
/// Some hundred replies; the longest frame that is known fits, too.
const ROOM: usize = 2048;

#[derive(Debug)]
pub(crate) struct ReplyScanner {
    bytes: [u8; ROOM],
    filled: usize,
}

impl Default for ReplyScanner {
    fn default() -> Self {
        Self {
            bytes: [0; ROOM],
            filled: 0,
        }
    }
}

impl ReplyScanner {
    /// Where the next bytes go; never empty once [`Self::next`] has given nothing.
    pub(crate) fn room(&mut self) -> &mut [u8] {
        &mut self.bytes[self.filled..]
    }

    /// So many bytes were put there.
    pub(crate) fn filled(&mut self, count: usize) {
        self.filled = (self.filled + count).min(ROOM);
    }

    /// The status of the next reply to a set-point; none until more bytes come. Other frames are left out.
    ///
    /// # Errors
    /// A length that cannot be: the stream cannot be read on.
    pub(crate) fn next(&mut self) -> Result<Option<Status>, StreamFault> {
        loop {
            let Some([_, _, _, _, high, low]) = self.bytes[..self.filled].first_chunk::<HEADER>() else {
                return Ok(None);
            };
            let length = usize::from(u16::from_be_bytes([*high, *low]));
            let end = HEADER + length;
            if length == 0 || end > ROOM {
                return Err(StreamFault::Disconnected);
            }
            if end > self.filled {
                return Ok(None);
            }
            let body = &self.bytes[HEADER..end];
            let status = match body {
                [register::SERVO_JOINT, status, ..] => Some(Status(*status)),
                _ => None,
            };
            self.bytes.copy_within(end..self.filled, 0);
            self.filled -= end;
            if status.is_some() {
                return Ok(status);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use xarm_protocol::{Protocol, Reply};

    fn reply(register: u8, status: u8) -> Vec<u8> {
        let reply = Reply {
            register,
            status: Status(status),
            data: vec![7; 3],
        };
        reply.frame(9, Protocol::Private).encode()
    }

    #[test]
    fn replies_are_found_in_any_pieces() {
        let stream = [reply(29, 0), reply(13, 0x40), reply(29, 0x10)].concat();
        for size in [1, 5, 11, stream.len()] {
            let mut scanner = ReplyScanner::default();
            let mut found = Vec::new();
            for piece in stream.chunks(size) {
                scanner.room()[..piece.len()].copy_from_slice(piece);
                scanner.filled(piece.len());
                while let Some(status) = scanner.next().expect("whole frames") {
                    found.push(status.0);
                }
            }
            assert_eq!(found, [0, 0x10], "in pieces of {size}");
        }
    }

    #[test]
    fn a_length_that_cannot_be_ends_it() {
        for length in [[0, 0], [0xFF, 0xFF]] {
            let mut scanner = ReplyScanner::default();
            scanner.room()[4..6].copy_from_slice(&length);
            scanner.filled(6);
            assert_eq!(scanner.next(), Err(StreamFault::Disconnected));
        }
    }
}
