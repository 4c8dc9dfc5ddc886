//! Clients of the control port: a thread for each that reads requests and writes replies.

use std::collections::HashMap;
use std::io::ErrorKind;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use xarm_protocol::{Frame, FrameReader, Protocol, ProtocolError};

use super::answer::{Asker, feedback_wish, modbus_exception};
use super::shared::Shared;
use super::wire::Wire;

/// A client that promised to say something every 30 s and says nothing for so long is gone.
const SILENCE: Duration = Duration::from_secs(90);
/// How often a thread that hears nothing looks how long that has been.
const LOOK_AROUND: Duration = Duration::from_secs(1);

#[derive(Default)]
pub(super) struct Clients {
    open: Mutex<HashMap<u64, Arc<Client>>>,
    threads: Mutex<Vec<JoinHandle<()>>>,
    last: Mutex<u64>,
}

pub(super) struct Client {
    number: u64,
    name: String,
    wire: Wire,
    /// Held from reading a request to its reply, so that what is told about it comes after.
    writing: Mutex<()>,
}

impl Clients {
    pub(super) fn count(&self) -> usize {
        self.open.lock().len()
    }

    /// Begins to serve a connection.
    pub(super) fn welcome(&self, shared: &Arc<Shared>, wire: Wire, name: String) -> std::io::Result<()> {
        wire.prepare()?;
        wire.set_read_timeout(LOOK_AROUND)?;
        let number = {
            let mut last = self.last.lock();
            *last += 1;
            *last
        };
        let client = Arc::new(Client {
            number,
            name,
            wire,
            writing: Mutex::new(()),
        });
        self.open.lock().insert(number, Arc::clone(&client));
        let shared = Arc::clone(shared);
        let thread = std::thread::spawn(move || {
            let reason = client.serve(&shared);
            tracing::info!("client {} of the simulated arm is gone: {reason}", client.name);
            client.wire.close();
            shared.clients.open.lock().remove(&client.number);
        });
        let mut threads = self.threads.lock();
        threads.retain(|thread| !thread.is_finished());
        threads.push(thread);
        Ok(())
    }

    /// Frames to clients that are still there.
    pub(super) fn send(&self, frames: Vec<(u64, Frame)>) {
        for (number, frame) in frames {
            let client = self.open.lock().get(&number).cloned();
            if let Some(client) = client {
                let _held = client.writing.lock();
                if client.wire.write_all(&frame.encode()).is_err() {
                    client.wire.close();
                }
            }
        }
    }

    /// Closes all connections.
    pub(super) fn drop_all(&self) {
        for client in self.open.lock().values() {
            client.wire.close();
        }
    }

    /// After [`drop_all`](Self::drop_all).
    pub(super) fn join(&self) {
        let threads = std::mem::take(&mut *self.threads.lock());
        for thread in threads {
            // A thread that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}

/// Why a connection ends.
#[derive(Debug, thiserror::Error)]
enum Ending {
    #[error("it hung up")]
    HungUp,
    #[error("it said nothing for {} s", SILENCE.as_secs())]
    Silent,
    #[error("what it sent is no frame: {0}")]
    Malformed(#[from] ProtocolError),
    #[error("it speaks protocol {0}, known are 0 to 3")]
    Protocol(u16),
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// What is known of a client from what it sent.
struct Session {
    heard: Instant,
    keeps_alive: bool,
    feedback: u8,
}

impl Client {
    fn serve(&self, shared: &Shared) -> Ending {
        let mut reader = FrameReader::default();
        let mut buffer = [0; 4096];
        let mut session = Session {
            heard: Instant::now(),
            keeps_alive: false,
            feedback: 0,
        };
        loop {
            match self.wire.read(&mut buffer) {
                Ok(0) => return Ending::HungUp,
                Ok(count) => {
                    session.heard = Instant::now();
                    reader.push(&buffer[..count]);
                }
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    if session.keeps_alive && session.heard.elapsed() > SILENCE {
                        return Ending::Silent;
                    }
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return error.into(),
            }
            if let Err(ending) = self.answer_all(shared, &mut reader, &mut session) {
                return ending;
            }
        }
    }

    fn answer_all(&self, shared: &Shared, reader: &mut FrameReader, session: &mut Session) -> Result<(), Ending> {
        while let Some(frame) = reader.next()? {
            if !shared.faults.wait_to_answer() {
                continue;
            }
            let reply = match frame.protocol {
                Protocol::Heartbeat => continue,
                Protocol::Modbus => modbus_exception(&frame),
                Protocol::Private | Protocol::KeepAlive => {
                    self.answer(shared, &frame, session)?;
                    continue;
                }
                Protocol::Other(number) => return Err(Ending::Protocol(number)),
            };
            let _held = self.writing.lock();
            self.wire.write_all(&reply.encode())?;
        }
        Ok(())
    }

    fn answer(&self, shared: &Shared, frame: &Frame, session: &mut Session) -> Result<(), Ending> {
        session.keeps_alive |= frame.protocol == Protocol::KeepAlive;
        let asker = Asker {
            client: self.number,
            feedback: session.feedback,
            at: session.heard,
        };
        {
            let _held = self.writing.lock();
            let reply = shared.core.lock().answer(&asker, frame);
            self.wire.write_all(&reply.encode())?;
        }
        session.feedback = feedback_wish(frame).unwrap_or(session.feedback);
        shared.deliver();
        Ok(())
    }
}
