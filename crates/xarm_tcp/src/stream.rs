//! Set-points, on a connection of their own: the thread that sends them shares no lock and no socket with anybody.

mod replies;
#[cfg(test)]
mod tests;

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;

use devices::{JointValues, SetPointStream, StreamFault};
use xarm_protocol::{Protocol, Request, Status, Transactions};

use crate::stream_end::{End, StreamEnd};
use replies::ReplyScanner;

/// Bytes that a set-point has on the wire: 47.
const ROOM: usize = 64;
/// Set-points that may be sent without one reply: 80 ms at 250 Hz, longer than a network's hiccup.
const MOST_UNANSWERED: u32 = 20;
/// From one set-point to the next, radians: eight periods at full speed. More is no motion but a mistake, and the
/// controller would try.
const LONGEST_STEP: f64 = 0.1;
/// Set-points in a row that the socket may not take.
const MOST_BLOCKED: u32 = 5;

/// Where the set-points go.
#[derive(Debug)]
pub(crate) struct Stream {
    socket: TcpStream,
    end: Arc<StreamEnd>,
    last: JointValues,
    transactions: Transactions,
    frame: Vec<u8>,
    /// Bytes of `frame` that were sent.
    sent: usize,
    blocked: u32,
    unanswered: u32,
    replies: ReplyScanner,
}

impl Stream {
    /// On a connection that sends at once and does not block, from where the arm stands (rad).
    pub(crate) fn new(socket: TcpStream, here: JointValues) -> Self {
        Self {
            socket,
            end: Arc::default(),
            last: here,
            transactions: Transactions::default(),
            frame: Vec::with_capacity(ROOM),
            sent: 0,
            blocked: 0,
            unanswered: 0,
            replies: ReplyScanner::default(),
        }
    }

    /// To end it, and to see that it has ended.
    pub(crate) fn end(&self) -> &Arc<StreamEnd> {
        &self.end
    }

    fn try_send(&mut self, angles: &JointValues) -> Result<(), StreamFault> {
        self.check(angles)?;
        self.drain()?;
        if self.unanswered >= MOST_UNANSWERED {
            return Err(StreamFault::Silent);
        }
        self.flush()?;
        if self.sent < self.frame.len() {
            // The frame before still waits; this set-point is left out, the next one is newer.
            return self.count_blocked();
        }
        self.encode(angles);
        self.unanswered += 1;
        self.flush()?;
        if self.sent < self.frame.len() {
            return self.count_blocked();
        }
        self.blocked = 0;
        Ok(())
    }

    fn check(&self, angles: &JointValues) -> Result<(), StreamFault> {
        let is_close = |(angle, last): (&f64, &f64)| (angle - last).abs() <= LONGEST_STEP;
        // No number is close to nothing.
        if angles.iter().zip(&self.last).all(is_close) {
            return Ok(());
        }
        Err(StreamFault::Refused)
    }

    fn encode(&mut self, angles: &JointValues) {
        self.last = *angles;
        let request = Request::ServoJoint {
            angles: angles.map(|angle| angle as f32),
            speed: 0.0,
            acceleration: 0.0,
            time: 0.0,
        };
        self.frame.clear();
        self.sent = 0;
        // Not the protocol that promises a word every half minute: a stream may pause.
        request.encode_into(self.transactions.next_number(), Protocol::Private, &mut self.frame);
    }

    fn flush(&mut self) -> Result<(), StreamFault> {
        while self.sent < self.frame.len() {
            match self.socket.write(&self.frame[self.sent..]) {
                Ok(0) => return Err(StreamFault::Disconnected),
                Ok(count) => self.sent += count,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(StreamFault::Disconnected),
            }
        }
        Ok(())
    }

    fn count_blocked(&mut self) -> Result<(), StreamFault> {
        self.blocked += 1;
        if self.blocked > MOST_BLOCKED {
            return Err(StreamFault::Disconnected);
        }
        Ok(())
    }

    /// Takes what has come, and looks at what the controller said.
    fn drain(&mut self) -> Result<(), StreamFault> {
        loop {
            match self.socket.read(self.replies.room()) {
                Ok(0) => return Err(StreamFault::Disconnected),
                Ok(count) => self.take(count)?,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return Err(StreamFault::Disconnected),
            }
        }
    }

    fn take(&mut self, count: usize) -> Result<(), StreamFault> {
        self.replies.filled(count);
        while let Some(status) = self.replies.next()? {
            self.unanswered = 0;
            judge(status)?;
        }
        Ok(())
    }
}

fn judge(status: Status) -> Result<(), StreamFault> {
    if status.has(Status::ERROR) {
        Err(StreamFault::ControllerError)
    } else if status.has(Status::NOT_READY) {
        Err(StreamFault::NotReady)
    } else if status.has(Status::INVALID) {
        Err(StreamFault::Refused)
    } else {
        Ok(())
    }
}

impl SetPointStream for Stream {
    fn send(&mut self, angles: &JointValues) -> Result<(), StreamFault> {
        match self.end.get() {
            None => {}
            Some(End::Fault(fault)) => return Err(fault),
            Some(End::Dropped) => return Err(StreamFault::NotReady),
        }
        self.try_send(angles)
            .inspect_err(|fault| self.end.end(End::Fault(*fault)))
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.end.end(End::Dropped);
    }
}
