//! Registers and memory as a client reads and writes them.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use crate::bootstrap as at;
use crate::config::DeviceConfig;
use crate::features::{
    COLUMN_STEP, FEATURES, HEARTBEAT_MILLIS, Kind, LEAST_PACKET_SIZE, MOST_PACKET_DELAY, MOST_PACKET_SIZE, own_feature,
};
use crate::genicam;
use crate::gvcp::{MAX_MEMORY_BYTES, Refusal};
use crate::register::REGISTER_COUNT;
use crate::{PixelFormat, Register};

const USER_NAME_BYTES: usize = 16;

/// All that an address leads to.
#[derive(Debug)]
pub(super) struct Memory {
    bootstrap: Vec<u8>,
    own: [u32; REGISTER_COUNT],
    xml: Vec<u8>,
    clock_origin: Duration,
}

impl Memory {
    pub(super) fn new(config: &DeviceConfig) -> Self {
        let mut xml = genicam::describe(&config.vendor, &config.model).into_bytes();
        // Clients read whole words.
        xml.resize(xml.len().next_multiple_of(4), b'\n');
        let mut memory = Self {
            bootstrap: vec![0; at::BOOTSTRAP_END as usize],
            own: std::array::from_fn(|index| FEATURES[index].initial),
            xml,
            clock_origin: Duration::ZERO,
        };
        memory.fill_bootstrap(config);
        memory.set(Register::SensorWidth, config.sensor_width);
        memory.set(Register::SensorHeight, config.sensor_height);
        memory.set(Register::Width, config.sensor_width);
        memory.set(Register::Height, config.sensor_height);
        memory
    }

    fn fill_bootstrap(&mut self, config: &DeviceConfig) {
        let ip = u32::from(config.ip);
        for (address, value) in [
            (at::VERSION, 0x0002_0000),
            (at::DEVICE_MODE, 0x8000_0001),
            // A locally administered address that differs with the IP address.
            (at::MAC_HIGH, 0x0200),
            (at::MAC_LOW, ip),
            (at::IP_CAPABILITY, 5),
            (at::IP_CONFIGURATION, 5),
            (at::CURRENT_IP, ip),
            (at::CURRENT_MASK, 0xff00_0000),
            (at::INTERFACES, 1),
            (at::STREAM_CHANNELS, 1),
            // Concatenated reads, WRITEMEM, PACKETRESEND; serial number and user name exist.
            (at::GVCP_CAPABILITY, 0xc000_0007),
            (at::HEARTBEAT_TIMEOUT, 3000),
            (at::TICK_FREQUENCY + 4, 1_000_000_000),
            (at::STREAM_PACKET_SIZE, 1500),
        ] {
            self.put(address, value);
        }
        let url = format!("Local:rakelight.xml;{:x};{:x}", at::XML, self.xml.len());
        for (address, text) in [
            (at::VENDOR, config.vendor.as_str()),
            (at::MODEL, &config.model),
            (at::DEVICE_VERSION, env!("CARGO_PKG_VERSION")),
            (at::INFO, "simulated camera"),
            (at::SERIAL, &config.serial),
            (at::USER_NAME, &config.user_name),
            (at::FIRST_URL, &url),
        ] {
            let start = address as usize;
            self.bootstrap[start..start + text.len()].copy_from_slice(text.as_bytes());
        }
    }

    fn put(&mut self, address: u32, value: u32) {
        let start = address as usize;
        self.bootstrap[start..start + 4].copy_from_slice(&value.to_be_bytes());
    }

    /// A bootstrap word; the address is one of ours.
    fn word(&self, address: u32) -> u32 {
        let start = address as usize;
        self.bootstrap[start..start + 4]
            .iter()
            .fold(0, |value, byte| value << 8 | u32::from(*byte))
    }

    pub(super) fn bootstrap(&self, count: usize) -> Vec<u8> {
        self.bootstrap[..count].to_vec()
    }

    pub(super) fn get(&self, register: Register) -> u32 {
        self.own[register as usize]
    }

    fn set(&mut self, register: Register, value: u32) {
        self.own[register as usize] = value;
    }

    pub(super) fn read(&self, address: u32) -> Result<u32, Refusal> {
        let bytes = self.read_bytes(address, 4)?;
        Ok(bytes.iter().fold(0, |value, byte| value << 8 | u32::from(*byte)))
    }

    pub(super) fn read_bytes(&self, address: u32, count: u16) -> Result<Vec<u8>, Refusal> {
        let count = usize::from(count);
        if !address.is_multiple_of(4) || !count.is_multiple_of(4) {
            return Err(Refusal::BadAlignment);
        }
        if count == 0 || count > MAX_MEMORY_BYTES {
            return Err(Refusal::InvalidParameter);
        }
        let own_bytes: Vec<u8>;
        let (start, memory) = match address {
            at::XML.. => (at::XML, self.xml.as_slice()),
            at::OWN_REGISTERS.. => {
                own_bytes = self.own.iter().flat_map(|value| value.to_be_bytes()).collect();
                (at::OWN_REGISTERS, own_bytes.as_slice())
            }
            _ => (0, self.bootstrap.as_slice()),
        };
        let from = (address - start) as usize;
        let bytes = memory.get(from..from + count).ok_or(Refusal::InvalidAddress)?;
        Ok(bytes.to_vec())
    }

    pub(super) fn write(&mut self, now: Duration, address: u32, value: u32, acquiring: bool) -> Result<(), Refusal> {
        if !address.is_multiple_of(4) {
            return Err(Refusal::BadAlignment);
        }
        match own_feature(address) {
            Some((index, feature)) => {
                if !feature.writable || feature.locked && acquiring {
                    return Err(Refusal::WriteProtected);
                }
                self.check(address, feature.kind, value)?;
                if !matches!(feature.kind, Kind::Command(_)) {
                    self.own[index] = value;
                }
                self.fit_region_to_binning(address);
                Ok(())
            }
            None => self.write_bootstrap(now, address, value),
        }
    }

    fn check(&self, address: u32, kind: Kind, value: u32) -> Result<(), Refusal> {
        let allowed = match kind {
            Kind::Integer { least, most, step, .. } => {
                let most = most.min(self.region_limit(address));
                (least..=most).contains(&value) && (value - least).is_multiple_of(step)
            }
            Kind::Float { least, most, .. } => (least..=most).contains(&value),
            Kind::Enumeration(entries) => entries.iter().any(|(_, code)| *code == value),
            Kind::Command(code) => value == code,
            Kind::Text(_) | Kind::Wide | Kind::Bits { .. } | Kind::Flag(_) => false,
        };
        if allowed {
            Ok(())
        } else {
            Err(Refusal::InvalidParameter)
        }
    }

    fn binned_sensor(&self) -> (u32, u32) {
        let width = self.get(Register::SensorWidth) / self.get(Register::BinningHorizontal);
        let height = self.get(Register::SensorHeight) / self.get(Register::BinningVertical);
        (width / COLUMN_STEP * COLUMN_STEP, height)
    }

    /// Most that the registers of the region may hold; what the description computes too.
    fn region_limit(&self, address: u32) -> u32 {
        let (width, height) = self.binned_sensor();
        let is = |register: Register| address == register.address();
        if is(Register::Width) {
            width - self.get(Register::OffsetX)
        } else if is(Register::Height) {
            height - self.get(Register::OffsetY)
        } else if is(Register::OffsetX) {
            width - self.get(Register::Width)
        } else if is(Register::OffsetY) {
            height - self.get(Register::Height)
        } else {
            u32::MAX
        }
    }

    /// A change of binning leaves of the region what is still on the sensor.
    fn fit_region_to_binning(&mut self, address: u32) {
        let is = |register: Register| address == register.address();
        if is(Register::BinningHorizontal) || is(Register::BinningVertical) {
            let (width, height) = self.binned_sensor();
            self.fit(Register::OffsetX, Register::Width, width);
            self.fit(Register::OffsetY, Register::Height, height);
        }
    }

    fn fit(&mut self, offset: Register, size: Register, most: u32) {
        if self.get(offset) + self.get(size) > most {
            self.set(offset, 0);
            self.set(size, self.get(size).min(most));
        }
    }

    fn write_bootstrap(&mut self, now: Duration, address: u32, value: u32) -> Result<(), Refusal> {
        let within = |allowed: bool| {
            if allowed {
                Ok(())
            } else {
                Err(Refusal::InvalidParameter)
            }
        };
        match address {
            at::HEARTBEAT_TIMEOUT => within((HEARTBEAT_MILLIS.0..=HEARTBEAT_MILLIS.1).contains(&value))?,
            at::STREAM_PACKET_SIZE => within((LEAST_PACKET_SIZE..=MOST_PACKET_SIZE).contains(&(value & 0xffff)))?,
            at::STREAM_PACKET_DELAY => within(value <= MOST_PACKET_DELAY)?,
            at::STREAM_PORT | at::STREAM_DESTINATION => {}
            at::TIMESTAMP_CONTROL => {
                self.control_clock(now, value);
                return Ok(());
            }
            at::OWN_REGISTERS.. => return Err(Refusal::InvalidAddress),
            _ if address < at::BOOTSTRAP_END => return Err(Refusal::WriteProtected),
            _ => return Err(Refusal::InvalidAddress),
        }
        self.put(address, value & !at::FIRE_TEST_PACKET | keep_top_bit(address, value));
        Ok(())
    }

    /// Only the latched value starts anew with a reset: stamps of frames keep to the one device time.
    fn control_clock(&mut self, now: Duration, value: u32) {
        if value & 1 != 0 {
            self.clock_origin = now;
        }
        if value & 2 != 0 {
            let nanos = now.saturating_sub(self.clock_origin).as_nanos() as u64;
            self.put(at::TIMESTAMP_VALUE, (nanos >> 32) as u32);
            self.put(at::TIMESTAMP_VALUE + 4, nanos as u32);
        }
    }

    pub(super) fn set_user_name(&mut self, name: &[u8]) -> Result<(), Refusal> {
        if name.len() > USER_NAME_BYTES {
            return Err(Refusal::InvalidParameter);
        }
        let start = at::USER_NAME as usize;
        let register = &mut self.bootstrap[start..start + USER_NAME_BYTES];
        register.fill(0);
        register[..name.len()].copy_from_slice(name);
        Ok(())
    }

    pub(super) fn set_privilege(&mut self, value: u32) {
        self.put(at::CONTROL_PRIVILEGE, value);
    }

    /// Nobody holds control: the stream ends, settings stay.
    pub(super) fn close(&mut self) {
        self.put(at::CONTROL_PRIVILEGE, 0);
        self.put(at::STREAM_PORT, 0);
        self.set(Register::TlParamsLocked, 0);
    }

    pub(super) fn heartbeat_timeout(&self) -> Duration {
        Duration::from_millis(u64::from(self.word(at::HEARTBEAT_TIMEOUT)))
    }

    pub(super) fn packet_size(&self) -> u32 {
        self.word(at::STREAM_PACKET_SIZE) & 0xffff
    }

    pub(super) fn packet_delay(&self) -> Duration {
        Duration::from_nanos(u64::from(self.word(at::STREAM_PACKET_DELAY)))
    }

    /// Where the stream goes, if it is open.
    pub(super) fn stream_destination(&self) -> Option<SocketAddrV4> {
        let port = self.word(at::STREAM_PORT) as u16;
        let ip = Ipv4Addr::from(self.word(at::STREAM_DESTINATION));
        (port != 0 && !ip.is_unspecified()).then(|| SocketAddrV4::new(ip, port))
    }

    pub(super) fn ip(&self) -> Ipv4Addr {
        Ipv4Addr::from(self.word(at::CURRENT_IP))
    }

    pub(super) fn pixel_format(&self) -> PixelFormat {
        // Writes are checked against the table, which lists exactly the formats.
        PixelFormat::from_code(self.get(Register::PixelFormat)).unwrap_or(PixelFormat::Mono16)
    }

    pub(super) fn xml(&self) -> &[u8] {
        &self.xml
    }
}

/// An address may have its top bit set; the bit that fires a test packet reads as 0.
fn keep_top_bit(address: u32, value: u32) -> u32 {
    if address == at::STREAM_PACKET_SIZE {
        0
    } else {
        value & at::FIRE_TEST_PACKET
    }
}
