//! Cuts frames into packets, paces them, and keeps the last frames to send parts of them again.

use std::collections::VecDeque;
use std::time::Duration;

use bytes::Bytes;

use crate::gvsp::{Content, HEADER_BYTES, IP_UDP_BYTES, Leader, Packet, STATUS_OK, STATUS_RESENT, STATUS_UNAVAILABLE};

/// Frames kept for resends, the one being sent included: a capture of eight and one more, so that the first packet of
/// a capture can still be had when its last one has left.
const FRAMES_KEPT: usize = 9;
/// Requests for resends that wait at most; a host asks again for what it still misses.
const MOST_RESENDS: usize = 1024;
/// A sender that woke up late may hurry by this much, no more: a burst would overrun the receiver's buffer.
const CATCH_UP: Duration = Duration::from_micros(200);

/// A frame ready to be sent, any packet of it at any time.
#[derive(Debug)]
pub(crate) struct Frame {
    pub(crate) block_id: u16,
    pub(crate) leader: Leader,
    pub(crate) image: Bytes,
    /// Bytes of image in a packet.
    chunk: usize,
}

impl Frame {
    /// `packet_size` counts IP and UDP headers.
    pub(crate) fn new(block_id: u16, leader: Leader, image: Bytes, packet_size: u32) -> Self {
        let chunk = packet_size as usize - IP_UDP_BYTES - HEADER_BYTES;
        Self {
            block_id,
            leader,
            image,
            chunk,
        }
    }

    /// Id of the trailer.
    pub(crate) fn last_packet_id(&self) -> u32 {
        self.image.len().div_ceil(self.chunk) as u32 + 1
    }

    fn content(&self, packet_id: u32) -> Content<'_> {
        if packet_id == 0 {
            return Content::Leader(self.leader);
        }
        let start = (packet_id as usize - 1) * self.chunk;
        if start >= self.image.len() {
            let height = self.leader.height;
            return Content::Trailer { height };
        }
        Content::Payload(&self.image[start..self.image.len().min(start + self.chunk)])
    }
}

/// A packet that was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sent {
    First { ends_frame: bool },
    Again,
}

/// What is to be sent, and when the next packet may leave.
#[derive(Debug, Default)]
pub(crate) struct Transmitter {
    /// The newest at the back.
    kept: VecDeque<Frame>,
    /// Next packet of the newest frame, while it is being sent.
    next: Option<u32>,
    /// (block, first, last)
    resends: VecDeque<(u16, u32, u32)>,
    due: Duration,
}

impl Transmitter {
    pub(crate) fn send(&mut self, frame: Frame) {
        if self.kept.len() == FRAMES_KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(frame);
        self.next = Some(0);
    }

    pub(crate) fn resend(&mut self, block_id: u64, first: u32, last: u32) {
        let Ok(block_id) = u16::try_from(block_id) else { return };
        if first <= last && self.resends.len() < MOST_RESENDS {
            self.resends.push_back((block_id, first, last));
        }
    }

    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// When the next packet may leave, if there is one.
    pub(crate) fn due(&self) -> Option<Duration> {
        (self.next.is_some() || !self.resends.is_empty()).then_some(self.due)
    }

    /// Writes the next packet, missing ones first.
    pub(crate) fn write(&mut self, now: Duration, delay: Duration, datagram: &mut Vec<u8>) -> Option<Sent> {
        let sent = match self.write_again(datagram) {
            Some(sent) => sent,
            None => self.write_first(datagram)?,
        };
        self.due = self.due.max(now.saturating_sub(CATCH_UP)) + delay;
        Some(sent)
    }

    fn write_first(&mut self, datagram: &mut Vec<u8>) -> Option<Sent> {
        let (frame, id) = (self.kept.back()?, self.next?);
        encode(frame, STATUS_OK, id, datagram);
        let ends_frame = id >= frame.last_packet_id();
        self.next = (!ends_frame).then_some(id + 1);
        Some(Sent::First { ends_frame })
    }

    /// Packets that have not been sent for the first time yet are on their way: they are not sent twice.
    fn write_again(&mut self, datagram: &mut Vec<u8>) -> Option<Sent> {
        while let Some((block_id, first, last)) = self.resends.pop_front() {
            let newest = self.kept.back().map(|frame| frame.block_id);
            let Some(frame) = self.kept.iter().find(|frame| frame.block_id == block_id) else {
                write_unavailable(block_id, first, datagram);
                return Some(Sent::Again);
            };
            let reached = match self.next {
                Some(next) if newest == Some(block_id) => next,
                _ => frame.last_packet_id() + 1,
            };
            if first >= reached {
                continue;
            }
            encode(frame, STATUS_RESENT, first, datagram);
            if first < last {
                self.resends.push_front((block_id, first + 1, last));
            }
            return Some(Sent::Again);
        }
        None
    }
}

fn encode(frame: &Frame, status: u16, packet_id: u32, datagram: &mut Vec<u8>) {
    Packet {
        status,
        block_id: frame.block_id,
        packet_id,
        content: frame.content(packet_id),
    }
    .encode(datagram);
}

fn write_unavailable(block_id: u16, packet_id: u32, datagram: &mut Vec<u8>) {
    Packet {
        status: STATUS_UNAVAILABLE,
        block_id,
        packet_id,
        content: Content::Payload(&[]),
    }
    .encode(datagram);
}
