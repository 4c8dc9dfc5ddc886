//! The device without its sockets: datagrams and times go in, datagrams and exposures come out.

mod acquisition;
mod control;
mod memory;

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use self::acquisition::Acquisition;
use self::control::Controller;
use self::memory::Memory;
use crate::bootstrap as at;
use crate::config::{Counters, DeviceConfig, Faults};
use crate::frame_source::FrameRequest;
use crate::gvcp::{Answer, Command, DISCOVERY_BYTES, Refusal, Request};
use crate::gvsp::IP_UDP_BYTES;
use crate::transmit::{Sent, Transmitter};
use crate::{GigeVisionError, Register};

/// What the caller does next for the stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// Send the datagram that was written to this address.
    Send(SocketAddrV4),
    /// Take the image of this exposure and hand it to [`Device::deliver`].
    Expose(FrameRequest),
    /// Come back at this device time, or when something was heard or triggered.
    Wait(Duration),
    /// Come back when something was heard or triggered.
    Idle,
}

/// A write that was carried out, so that its repetition (the answer got lost) is answered and not carried out again.
#[derive(Debug)]
struct LastWrite {
    from: SocketAddrV4,
    datagram: Vec<u8>,
    answer: Vec<u8>,
}

/// A camera. Times are device time: from its start, by a clock that never goes back.
#[derive(Debug)]
pub struct Device {
    memory: Memory,
    controller: Option<Controller>,
    acquisition: Acquisition,
    transmitter: Transmitter,
    test_packet: bool,
    last_write: Option<LastWrite>,
    faults: Faults,
    random: fastrand::Rng,
    counters: Counters,
}

impl Device {
    /// A device with all registers at their defaults.
    pub fn new(config: &DeviceConfig) -> Result<Self, GigeVisionError> {
        config.check()?;
        Ok(Self {
            memory: Memory::new(config),
            controller: None,
            acquisition: Acquisition::default(),
            transmitter: Transmitter::default(),
            test_packet: false,
            last_write: None,
            faults: Faults::default(),
            random: fastrand::Rng::with_seed(0),
            counters: Counters::default(),
        })
    }

    /// Takes a datagram of the control port; gives the answer to send back, if any.
    pub fn handle_command(&mut self, now: Duration, from: SocketAddrV4, datagram: &[u8]) -> Option<Vec<u8>> {
        if self.faults.muted {
            return None;
        }
        self.expire_control(now);
        let request = match Request::decode(datagram) {
            Ok(request) => request,
            Err(error) => return self.refuse_malformed(&error),
        };
        self.note_heartbeat(now, from);
        if let Some(last) = self
            .last_write
            .as_ref()
            .filter(|last| last.from == from && last.datagram == datagram)
        {
            return Some(last.answer.clone());
        }
        let answer = self.carry_out(now, from, &request.command)?.encode(request.id);
        let is_write = matches!(
            request.command,
            Command::WriteRegisters(_) | Command::WriteMemory { .. }
        );
        self.last_write = (is_write && request.acknowledge).then(|| LastWrite {
            from,
            datagram: datagram.to_vec(),
            answer: answer.clone(),
        });
        request.acknowledge.then_some(answer)
    }

    fn refuse_malformed(&mut self, error: &GigeVisionError) -> Option<Vec<u8>> {
        self.counters.malformed_commands += 1;
        let (command, id, acknowledge, refusal) = match error {
            GigeVisionError::UnknownCommand {
                command,
                id,
                acknowledge,
            } => (*command, *id, *acknowledge, Refusal::NotImplemented),
            GigeVisionError::Command {
                command,
                id,
                acknowledge,
                ..
            } => (*command, *id, *acknowledge, Refusal::InvalidParameter),
            _ => return None,
        };
        acknowledge.then(|| Answer::Refused { command, refusal }.encode(id))
    }

    fn carry_out(&mut self, now: Duration, from: SocketAddrV4, command: &Command) -> Option<Answer> {
        let (code, outcome) = match command {
            Command::Discovery => (0x0002, Ok(Answer::Discovery(self.memory.bootstrap(DISCOVERY_BYTES)))),
            Command::ReadRegisters(addresses) => (0x0080, self.read_registers(from, addresses)),
            Command::WriteRegisters(writes) => (0x0082, self.write_registers(now, from, writes)),
            Command::ReadMemory { address, count } => (0x0084, self.read_memory(from, *address, *count)),
            Command::WriteMemory { address, data } => (0x0086, self.write_memory(now, from, *address, data)),
            Command::PacketResend {
                block_id, first, last, ..
            } => {
                // Aravis asks from its stream socket: same host, another port.
                if self
                    .controller
                    .is_some_and(|controller| controller.address.ip() == from.ip())
                {
                    self.transmitter.resend(*block_id, *first, *last);
                }
                return None;
            }
        };
        Some(outcome.unwrap_or_else(|refusal| Answer::Refused { command: code, refusal }))
    }

    fn read_registers(&self, from: SocketAddrV4, addresses: &[u32]) -> Result<Answer, Refusal> {
        self.may_read(from)?;
        let values = addresses.iter().map(|&address| self.memory.read(address));
        values.collect::<Result<_, _>>().map(Answer::ReadRegisters)
    }

    fn read_memory(&self, from: SocketAddrV4, address: u32, count: u16) -> Result<Answer, Refusal> {
        self.may_read(from)?;
        let data = self.memory.read_bytes(address, count)?;
        Ok(Answer::ReadMemory { address, data })
    }

    fn write_registers(&mut self, now: Duration, from: SocketAddrV4, writes: &[(u32, u32)]) -> Result<Answer, Refusal> {
        for &(address, value) in writes {
            self.write(now, from, address, value)?;
        }
        Ok(Answer::WriteRegisters(writes.len() as u32))
    }

    fn write_memory(
        &mut self,
        now: Duration,
        from: SocketAddrV4,
        address: u32,
        data: &[u8],
    ) -> Result<Answer, Refusal> {
        if !data.len().is_multiple_of(4) {
            return Err(Refusal::BadAlignment);
        }
        if address == at::USER_NAME {
            self.may_write(from)?;
            self.memory.set_user_name(data)?;
            return Ok(Answer::WriteMemory(address));
        }
        for (index, word) in data.chunks_exact(4).enumerate() {
            let value = word.iter().fold(0, |value, byte| value << 8 | u32::from(*byte));
            let place = address.checked_add(4 * index as u32).ok_or(Refusal::InvalidAddress)?;
            self.write(now, from, place, value)?;
        }
        Ok(Answer::WriteMemory(address))
    }

    fn write(&mut self, now: Duration, from: SocketAddrV4, address: u32, value: u32) -> Result<(), Refusal> {
        if address == at::CONTROL_PRIVILEGE {
            return self.write_privilege(now, from, value);
        }
        self.may_write(from)?;
        let was_closed = self.memory.stream_destination().is_none();
        self.memory.write(now, address, value, self.acquisition.is_running())?;
        let is = |register: Register| address == register.address();
        if is(Register::AcquisitionStart) {
            self.acquisition.start(now, &self.memory);
        } else if is(Register::AcquisitionStop) {
            self.acquisition.stop();
        } else if is(Register::TriggerSoftware) {
            self.software_trigger(now);
        } else if address == at::STREAM_PACKET_SIZE {
            self.test_packet |= value & at::FIRE_TEST_PACKET != 0;
        } else if address == at::STREAM_PORT {
            self.stream_port_written(was_closed);
        }
        Ok(())
    }

    /// Block ids begin anew with a stream, never with an acquisition: a host takes a low id for a late frame.
    fn stream_port_written(&mut self, was_closed: bool) {
        let is_closed = self.memory.stream_destination().is_none();
        if is_closed || was_closed {
            self.transmitter.clear();
            self.acquisition.restart_block_ids();
        }
    }

    fn software_trigger(&mut self, now: Duration) {
        if !self.acquisition.software_trigger(now, &self.memory) {
            self.counters.triggers_ignored += 1;
        }
    }

    /// The trigger line's rising edge at this device time, now or later.
    pub fn line_trigger(&mut self, at: Duration) {
        if !self.acquisition.line_trigger(at, &self.memory) {
            self.counters.triggers_ignored += 1;
        }
    }

    /// What is next for the stream; a packet to send is written to `datagram`.
    pub fn next_step(&mut self, now: Duration, datagram: &mut Vec<u8>) -> Step {
        self.expire_control(now);
        if let Some(step) = self.next_packet(now, datagram) {
            return step;
        }
        if let Some(request) = self
            .acquisition
            .due_exposure(now, &self.memory, self.faults.frame_delay)
        {
            return Step::Expose(request);
        }
        let heartbeat = self.controller.map(|controller| {
            // One tick after the last moment that still counts.
            controller.heard_at + self.memory.heartbeat_timeout() + Duration::from_nanos(1)
        });
        let exposure = self.acquisition.next_exposure(&self.memory, self.faults.frame_delay);
        match [heartbeat, exposure].into_iter().flatten().min() {
            Some(until) => Step::Wait(until),
            None => Step::Idle,
        }
    }

    /// While packets wait for their turn nothing else is begun.
    fn next_packet(&mut self, now: Duration, datagram: &mut Vec<u8>) -> Option<Step> {
        let destination = self.memory.stream_destination()?;
        if std::mem::take(&mut self.test_packet) {
            datagram.clear();
            datagram.resize(self.memory.packet_size() as usize - IP_UDP_BYTES, 0);
            return (!self.faults.muted).then_some(Step::Send(destination));
        }
        while let Some(due) = self.transmitter.due() {
            if due > now {
                return Some(Step::Wait(due));
            }
            let sent = self.transmitter.write(now, self.memory.packet_delay(), datagram)?;
            if self.count(sent) {
                return Some(Step::Send(destination));
            }
        }
        None
    }

    /// Whether the packet really leaves.
    fn count(&mut self, sent: Sent) -> bool {
        if let Sent::First { ends_frame: true } = sent {
            self.counters.frames_sent += 1;
        }
        // The dice are thrown for every packet, so that a seed means the same whatever else is wrong.
        let lost = self.random.f64() < self.faults.drop_ratio;
        if lost || self.faults.muted {
            self.counters.packets_dropped += 1;
            return false;
        }
        match sent {
            Sent::First { .. } => self.counters.packets_sent += 1,
            Sent::Again => self.counters.packets_resent += 1,
        }
        true
    }

    /// The image of an exposure that [`Step::Expose`] asked for.
    pub fn deliver(&mut self, request: &FrameRequest, image: bytes::Bytes) -> Result<(), GigeVisionError> {
        let (found, needed) = (image.len(), request.image_bytes());
        if found != needed {
            self.counters.images_refused += 1;
            self.acquisition.give_up(request);
            return Err(GigeVisionError::ImageSize { found, needed });
        }
        let frame = self
            .acquisition
            .frame(request, image, self.memory.packet_size(), &self.faults)
            .ok_or(GigeVisionError::Stale)?;
        if self.memory.stream_destination().is_some() {
            self.transmitter.send(frame);
        }
        Ok(())
    }

    /// Changes what goes wrong.
    pub fn set_faults(&mut self, faults: Faults) {
        if faults.drop_seed != self.faults.drop_seed || faults.drop_ratio.to_bits() != self.faults.drop_ratio.to_bits()
        {
            self.random = fastrand::Rng::with_seed(faults.drop_seed);
        }
        self.faults = faults;
    }

    /// What has happened so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    pub(crate) fn note_send_error(&mut self) {
        self.counters.send_errors += 1;
    }

    /// The client that holds control.
    pub fn controller(&self) -> Option<SocketAddrV4> {
        self.controller.map(|controller| controller.address)
    }

    /// Where the stream goes, while it is open.
    pub fn stream_destination(&self) -> Option<SocketAddrV4> {
        self.memory.stream_destination()
    }

    /// Whether acquisition has been started and has not ended.
    pub fn is_acquiring(&self) -> bool {
        self.acquisition.is_running()
    }

    /// The value of one of the device's own registers.
    pub fn register(&self, register: Register) -> u32 {
        self.memory.get(register)
    }

    /// The GenICam description it serves.
    pub fn xml(&self) -> &[u8] {
        self.memory.xml()
    }

    /// The address it tells clients to use.
    pub fn ip(&self) -> Ipv4Addr {
        self.memory.ip()
    }
}
