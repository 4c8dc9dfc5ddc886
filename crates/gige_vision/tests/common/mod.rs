//! A small GigE Vision client, written for these tests: it shares the codecs with the device and nothing else.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::time::{Duration, Instant};

use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Answer, Command, Request};
use gige_vision::gvsp::{Content, Leader, Packet};
use gige_vision::{Refusal, Register};

/// Far beyond what anything here takes: it ends a test that would hang.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// Waits for a condition; says what was waited for.
pub(crate) fn wait_until(what: &str, mut condition: impl FnMut() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !condition() {
        assert!(Instant::now() < end, "{what} has not come about");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// One frame as it arrives.
#[derive(Debug, Default)]
pub(crate) struct Frame {
    pub(crate) leader: Option<Leader>,
    pub(crate) payload: BTreeMap<u32, Vec<u8>>,
    pub(crate) trailer: Option<u32>,
}

impl Frame {
    /// First packet that is not there, if the number of packets is known.
    pub(crate) fn missing(&self, chunk: usize) -> Vec<u32> {
        let Some(leader) = self.leader else { return vec![0] };
        let pixels = leader.width as usize * leader.height as usize;
        let packets = (pixels * leader.pixel_format.bytes_per_pixel()).div_ceil(chunk) as u32;
        let mut missing: Vec<u32> = (1..=packets).filter(|id| !self.payload.contains_key(id)).collect();
        if self.trailer.is_none() {
            missing.push(packets + 1);
        }
        missing
    }

    pub(crate) fn image(&self) -> Vec<u8> {
        self.payload.values().flatten().copied().collect()
    }
}

pub(crate) struct Client {
    control: UdpSocket,
    stream: UdpSocket,
    device: SocketAddrV4,
    id: u16,
    pub(crate) frames: BTreeMap<u16, Frame>,
    pub(crate) chunk: usize,
}

impl Client {
    pub(crate) fn new(device: SocketAddrV4) -> Self {
        let open = || {
            let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
            socket.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
            socket
        };
        Self {
            control: open(),
            stream: open(),
            device,
            id: 0,
            frames: BTreeMap::new(),
            chunk: 0,
        }
    }

    /// As a host does: asks again until the answer with this id comes.
    pub(crate) fn ask(&mut self, command: Command) -> Answer {
        self.try_ask(command, PATIENCE).expect("an answer")
    }

    pub(crate) fn try_ask(&mut self, command: Command, patience: Duration) -> Option<Answer> {
        self.id += 1;
        let request = Request {
            id: self.id,
            acknowledge: true,
            command,
        };
        let end = Instant::now() + patience;
        let mut datagram = [0; 2048];
        while Instant::now() < end {
            self.control.send_to(&request.encode(), self.device).unwrap();
            match self.control.recv(&mut datagram) {
                Ok(length) => {
                    let (id, answer) = Answer::decode(&datagram[..length]).unwrap();
                    if id == self.id {
                        return Some(answer);
                    }
                }
                Err(error) => assert!(
                    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
                    "{error}"
                ),
            }
        }
        None
    }

    pub(crate) fn write(&mut self, address: u32, value: u32) -> Result<(), Refusal> {
        match self.ask(Command::WriteRegisters(vec![(address, value)])) {
            Answer::WriteRegisters(_) => Ok(()),
            Answer::Refused { refusal, .. } => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn set(&mut self, register: Register, value: u32) {
        self.write(register.address(), value).unwrap();
    }

    pub(crate) fn read(&mut self, address: u32) -> u32 {
        match self.ask(Command::ReadRegisters(vec![address])) {
            Answer::ReadRegisters(values) => values[0],
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn take_control(&mut self) -> Result<(), Refusal> {
        self.write(at::CONTROL_PRIVILEGE, at::PRIVILEGE_CONTROL)
    }

    /// Opens the stream and starts acquisition on the trigger line.
    pub(crate) fn arm(&mut self, packet_size: u32) {
        let SocketAddr::V4(local) = self.stream.local_addr().unwrap() else {
            panic!("not IPv4")
        };
        self.write(at::STREAM_DESTINATION, u32::from(*local.ip())).unwrap();
        self.write(at::STREAM_PORT, u32::from(local.port())).unwrap();
        self.write(at::STREAM_PACKET_SIZE, packet_size).unwrap();
        self.write(at::STREAM_PACKET_DELAY, 20_000).unwrap();
        self.chunk = packet_size as usize - 36;
        self.set(Register::TriggerMode, 1);
        self.set(Register::TriggerSource, 1);
        self.set(Register::AcquisitionStart, 1);
    }

    /// Takes what the stream has; false when there was nothing for a while.
    fn receive(&mut self, datagram: &mut [u8]) -> bool {
        let Ok(length) = self.stream.recv(datagram) else {
            return false;
        };
        let packet = Packet::decode(&datagram[..length]).unwrap();
        let frame = self.frames.entry(packet.block_id).or_default();
        match packet.content {
            Content::Leader(leader) => frame.leader = Some(leader),
            Content::Payload(bytes) => {
                frame.payload.insert(packet.packet_id, bytes.to_vec());
            }
            Content::Trailer { height } => frame.trailer = Some(height),
        }
        true
    }

    /// Receives frames 1 to `count` whole, asking again for every packet that is missing.
    pub(crate) fn receive_frames(&mut self, count: u16) {
        let mut datagram = vec![0; 65536];
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            if self.receive(&mut datagram) {
                continue;
            }
            let mut whole = true;
            for block_id in 1..=count {
                let missing = self.frames.entry(block_id).or_default().missing(self.chunk);
                whole &= missing.is_empty();
                for packet_id in missing {
                    self.ask_again(block_id, packet_id);
                }
            }
            if whole {
                return;
            }
        }
        panic!("frames are still incomplete");
    }

    fn ask_again(&mut self, block_id: u16, packet_id: u32) {
        self.id += 1;
        let command = Command::PacketResend {
            block_id: u64::from(block_id),
            first: packet_id,
            last: packet_id,
            extended: false,
        };
        let request = Request {
            id: self.id,
            acknowledge: false,
            command,
        };
        self.control.send_to(&request.encode(), self.device).unwrap();
    }
}
