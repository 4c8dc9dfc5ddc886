//! A client of one camera: sets registers, and puts frames together from their packets.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::{Arc, Weak, mpsc};
use std::time::{Duration, Instant};

use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Answer, Command, Request};
use gige_vision::gvsp::{Content, Leader, Packet};
use gige_vision::{Register, Server};

use crate::PATIENCE;

/// With its headers. It fits into a page of the system's memory with all that comes with it, so that the system keeps a
/// whole capture until this client has time for it.
const PACKET_SIZE: u32 = 3500;

/// A whole image of sixteen bits.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frame {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Vec<u16>,
}

pub(crate) struct Camera {
    control: UdpSocket,
    device: SocketAddrV4,
    id: u16,
    frames: mpsc::Receiver<Frame>,
    /// The receiving thread ends when it is gone.
    _open: Arc<()>,
}

impl Camera {
    /// Takes control and sets the camera up for the trigger line.
    pub(crate) fn open(server: &Server, exposure: Duration) -> Self {
        let socket = || {
            let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
            socket.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
            socket
        };
        let (stream, open) = (socket(), Arc::new(()));
        let SocketAddr::V4(local) = stream.local_addr().unwrap() else {
            panic!("not IPv4")
        };
        let (sender, frames) = mpsc::channel();
        let is_open = Arc::downgrade(&open);
        // At once: the system keeps hardly a capture for who does not listen.
        std::thread::spawn(move || receive(&stream, &is_open, &sender));
        let mut camera = Self {
            control: socket(),
            device: server.address(),
            id: 0,
            frames,
            _open: open,
        };
        camera.write(at::CONTROL_PRIVILEGE, at::PRIVILEGE_CONTROL);
        // This client does not beat: it keeps control while a busy computer renders.
        camera.write(at::HEARTBEAT_TIMEOUT, 2 * PATIENCE.as_millis() as u32);
        camera.write(at::STREAM_DESTINATION, u32::from(*local.ip()));
        camera.write(at::STREAM_PORT, u32::from(local.port()));
        camera.write(at::STREAM_PACKET_SIZE, PACKET_SIZE);
        camera.write(at::STREAM_PACKET_DELAY, 20_000);
        camera.set(Register::ExposureTime, exposure.as_nanos() as u32);
        camera.set(Register::TriggerMode, 1);
        camera.set(Register::TriggerSource, 1);
        camera
    }

    pub(crate) fn set(&mut self, register: Register, value: u32) {
        self.write(register.address(), value);
    }

    pub(crate) fn start(&mut self) {
        self.set(Register::AcquisitionStart, 1);
    }

    pub(crate) fn stop(&mut self) {
        self.set(Register::AcquisitionStop, 1);
    }

    fn write(&mut self, address: u32, value: u32) {
        self.id += 1;
        let request = Request {
            id: self.id,
            acknowledge: true,
            command: Command::WriteRegisters(vec![(address, value)]),
        };
        let end = Instant::now() + PATIENCE;
        let mut datagram = [0; 1024];
        while Instant::now() < end {
            self.control.send_to(&request.encode(), self.device).unwrap();
            if let Some(length) = received(self.control.recv(&mut datagram)) {
                let (id, answer) = Answer::decode(&datagram[..length]).unwrap();
                if id == self.id {
                    assert!(matches!(answer, Answer::WriteRegisters(_)), "{address:#x}: {answer:?}");
                    return;
                }
            }
        }
        panic!("no answer to a write of {address:#x}");
    }

    /// The next frames, in order.
    pub(crate) fn frames(&mut self, count: usize) -> Vec<Frame> {
        let frame = |index| {
            let frame = self.frames.recv_timeout(PATIENCE);
            frame.unwrap_or_else(|error| panic!("frame {index} of {}: {error}", self.device))
        };
        (0..count).map(frame).collect()
    }

    /// Whether nothing comes for a while.
    pub(crate) fn is_silent(&self) -> bool {
        self.frames.recv_timeout(Duration::from_millis(300)).is_err()
    }
}

fn receive(stream: &UdpSocket, is_open: &Weak<()>, frames: &mpsc::Sender<Frame>) {
    let (mut leader, mut bytes) = (None, Vec::new());
    let mut datagram = vec![0; PACKET_SIZE as usize];
    while is_open.upgrade().is_some() {
        let Some(length) = received(stream.recv(&mut datagram)) else {
            continue;
        };
        match Packet::decode(&datagram[..length]).unwrap().content {
            Content::Leader(found) => {
                leader = Some(found);
                bytes.clear();
            }
            Content::Payload(part) => bytes.extend_from_slice(part),
            // The test may have ended.
            Content::Trailer { .. } => _ = frames.send(whole(&leader.expect("a leader comes first"), &bytes)),
        }
    }
}

fn whole(leader: &Leader, bytes: &[u8]) -> Frame {
    let (width, height) = (leader.width as usize, leader.height as usize);
    let (pixels, rest) = bytes.as_chunks::<2>();
    assert!(
        rest.is_empty() && pixels.len() == width * height,
        "{} bytes of {leader:?}",
        bytes.len()
    );
    Frame {
        width,
        height,
        pixels: pixels.iter().map(|pixel| u16::from_le_bytes(*pixel)).collect(),
    }
}

fn received(outcome: std::io::Result<usize>) -> Option<usize> {
    match outcome {
        Ok(length) => Some(length),
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => None,
        Err(error) => panic!("{error}"),
    }
}
