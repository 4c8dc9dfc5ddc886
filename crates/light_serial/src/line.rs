//! An open port: frames out, frames in.

use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use light_protocol::{BAUD, Command, Host, LightProtocolError, Received};
use serialport::{ClearBuffer, ErrorKind, SerialPort};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_serial::SerialStream;

use crate::error::LinkError;
use crate::ports;
use crate::shared::Shared;

/// A frame takes 15 ms on the line; a port that takes none for so long is stuck.
const WRITE_PATIENCE: Duration = Duration::from_millis(300);

/// A command that is on its way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sent {
    pub(crate) number: u8,
    pub(crate) at: Instant,
    pub(crate) bytes: usize,
}

/// A frame that came.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrived {
    pub(crate) content: Result<Received, LightProtocolError>,
    pub(crate) at: Instant,
    /// Bytes between its delimiters and these.
    pub(crate) bytes: usize,
}

/// A port that is ours alone until this is dropped.
pub(crate) struct Line {
    stream: SerialStream,
    port: String,
    host: Host,
    arrived: VecDeque<Arrived>,
    bytes_since_frame: usize,
    shared: Arc<Shared>,
}

impl Line {
    /// Opening resets a real Uno.
    pub(crate) fn open(path: &Path, shared: Arc<Shared>) -> Result<Self, LinkError> {
        let port = path.display().to_string();
        let failed = |error| open_error(path, &error);
        let builder = tokio_serial::new(port.clone(), BAUD).exclusive(true);
        let stream = SerialStream::open(&builder).map_err(failed)?;
        // What an earlier conversation left behind.
        stream.clear(ClearBuffer::Input).map_err(failed)?;
        Ok(Self {
            stream,
            port,
            host: Host::new(),
            arrived: VecDeque::new(),
            bytes_since_frame: 0,
            shared,
        })
    }

    /// As configured.
    pub(crate) fn port(&self) -> &str {
        &self.port
    }

    pub(crate) async fn send(&mut self, command: &Command) -> Result<Sent, LinkError> {
        let (number, bytes) = self.host.send(command);
        let at = Instant::now();
        let written = tokio::time::timeout(WRITE_PATIENCE, self.stream.write_all(&bytes)).await;
        match written {
            Ok(Ok(())) => Ok(Sent {
                number,
                at,
                bytes: bytes.len(),
            }),
            Ok(Err(reason)) => Err(self.lost(reason)),
            Err(_) => Err(self.lost(io::ErrorKind::TimedOut.into())),
        }
    }

    /// The next frame, whole or damaged. Cancel safe.
    pub(crate) async fn receive(&mut self) -> Result<Arrived, LinkError> {
        loop {
            if let Some(arrived) = self.arrived.pop_front() {
                return Ok(arrived);
            }
            let mut bytes = [0; 512];
            match self.stream.read(&mut bytes).await {
                Ok(0) => return Err(self.lost(io::Error::other("it was unplugged"))),
                Ok(length) => self.decode(&bytes[..length]),
                Err(reason) => return Err(self.lost(reason)),
            }
        }
    }

    fn decode(&mut self, bytes: &[u8]) {
        let at = Instant::now();
        for byte in bytes {
            self.bytes_since_frame += 1;
            let Some(content) = self.host.receive(*byte) else {
                continue;
            };
            self.shared.count(|statistics| match content {
                Ok(_) => statistics.frames_received += 1,
                Err(_) => statistics.bad_frames_received += 1,
            });
            let bytes = std::mem::take(&mut self.bytes_since_frame);
            self.arrived.push_back(Arrived { content, at, bytes });
        }
    }

    fn lost(&self, reason: io::Error) -> LinkError {
        LinkError::Lost {
            port: self.port.clone(),
            reason,
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        // A terminal whose other end stays open would keep the others out for ever. It may be gone already.
        let _ = self.stream.set_exclusive(false);
    }
}

fn open_error(path: &Path, error: &serialport::Error) -> LinkError {
    let port = path.display().to_string();
    let text = error.description.to_lowercase();
    match error.kind() {
        _ if text.contains("exclusive lock") || text.contains("busy") => LinkError::InUse { port },
        _ if !path.exists() => LinkError::NoPort { port },
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => LinkError::Forbidden {
            port,
            advice: ports::advice(path),
        },
        _ => LinkError::Open {
            port,
            reason: error.description.clone(),
        },
    }
}
