//! A device on the bench: commands by hand, time by hand, no sockets.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use bytes::Bytes;
use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Answer, Command, Request};
use gige_vision::{Device, DeviceConfig, FrameRequest, Refusal, Register};

pub(crate) const HOST: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 40_000);
pub(crate) const OTHER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 40_001);

pub(crate) fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// A device and the next request id.
pub(crate) struct Bench {
    pub(crate) device: Device,
    id: u16,
    pub(crate) now: Duration,
}

impl Bench {
    pub(crate) fn new() -> Self {
        let config = DeviceConfig {
            sensor_width: 64,
            sensor_height: 48,
            ..DeviceConfig::new("T1", Ipv4Addr::new(127, 0, 0, 9))
        };
        Self {
            device: Device::new(&config).unwrap(),
            id: 0,
            now: millis(1),
        }
    }

    pub(crate) fn ask(&mut self, from: SocketAddrV4, command: Command) -> Answer {
        self.id += 1;
        let request = Request {
            id: self.id,
            acknowledge: true,
            command,
        };
        let answer = self.device.handle_command(self.now, from, &request.encode());
        let (id, answer) = Answer::decode(&answer.expect("an answer")).unwrap();
        assert_eq!(id, self.id);
        answer
    }

    pub(crate) fn try_write(&mut self, from: SocketAddrV4, address: u32, value: u32) -> Result<(), Refusal> {
        match self.ask(from, Command::WriteRegisters(vec![(address, value)])) {
            Answer::WriteRegisters(1) => Ok(()),
            Answer::Refused { refusal, .. } => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn write(&mut self, address: u32, value: u32) {
        self.try_write(HOST, address, value).unwrap();
    }

    pub(crate) fn set(&mut self, register: Register, value: u32) -> Result<(), Refusal> {
        self.try_write(HOST, register.address(), value)
    }

    pub(crate) fn read(&mut self, from: SocketAddrV4, address: u32) -> Result<u32, Refusal> {
        match self.ask(from, Command::ReadRegisters(vec![address])) {
            Answer::ReadRegisters(values) => Ok(values[0]),
            Answer::Refused { refusal, .. } => Err(refusal),
            other => panic!("{other:?}"),
        }
    }

    /// Control taken, stream open, waiting for the trigger line.
    pub(crate) fn armed() -> Self {
        let mut bench = Self::new();
        bench.write(at::CONTROL_PRIVILEGE, 2);
        bench.write(at::STREAM_DESTINATION, u32::from(*HOST.ip()));
        bench.write(at::STREAM_PORT, 50_000);
        bench.write(at::STREAM_PACKET_SIZE, 1036);
        bench.set(Register::TriggerMode, 1).unwrap();
        bench.set(Register::TriggerSource, 1).unwrap();
        bench.set(Register::AcquisitionStart, 1).unwrap();
        bench
    }
}

pub(crate) fn picture(request: &FrameRequest) -> Bytes {
    (0..request.image_bytes()).map(|index| (index % 251) as u8).collect()
}
