use crate::frame::{FrameDecoder, Packet};
use crate::{Command, LightProtocolError, Message};

/// What came from the firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Received {
    /// Of the command it answers or tells of; 0 for a BOOT and for a NAK to a frame that could not be read.
    pub sequence_number: u8,
    /// The reply or event.
    pub message: Message,
}

/// The host's end of the line: numbers what is sent, decodes what comes.
#[derive(Debug, Clone)]
pub struct Host {
    decoder: FrameDecoder,
    last_number: u8,
}

impl Default for Host {
    fn default() -> Self {
        Self::new()
    }
}

impl Host {
    /// At an opened port.
    pub const fn new() -> Self {
        Self {
            decoder: FrameDecoder::new(),
            last_number: 0,
        }
    }

    /// The command's sequence number (1..=255, in turn) and the bytes to write.
    pub fn send(&mut self, command: &Command) -> (u8, Packet) {
        self.last_number = self.last_number.checked_add(1).unwrap_or(1);
        (self.last_number, command.to_frame(self.last_number).encode())
    }

    /// Takes the next byte from the line. An error tells of a frame that was lost; what follows is not affected.
    pub fn receive(&mut self, byte: u8) -> Option<Result<Received, LightProtocolError>> {
        let frame = match self.decoder.push(byte)? {
            Ok(frame) => frame,
            Err(error) => return Some(Err(error)),
        };
        Some(Message::from_frame(&frame).map(|message| Received {
            sequence_number: frame.sequence_number(),
            message,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_run_from_1_to_255_and_never_are_0() {
        let mut host = Host::new();
        assert!((1..=255).all(|number| host.send(&Command::Ping).0 == number));
        assert_eq!(host.send(&Command::Ping).0, 1);
    }
}
