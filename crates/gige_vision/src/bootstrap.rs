//! Addresses of the bootstrap registers that GigE Vision fixes, and where this device keeps its own.

/// Version of the specification, device mode, MAC address.
pub const VERSION: u32 = 0x000;
/// Byte order and character set.
pub const DEVICE_MODE: u32 = 0x004;
/// MAC address, two bytes in the low half.
pub const MAC_HIGH: u32 = 0x008;
/// MAC address, last four bytes.
pub const MAC_LOW: u32 = 0x00c;
/// Ways of getting an address that the device knows.
pub const IP_CAPABILITY: u32 = 0x010;
/// Ways of getting an address that are on.
pub const IP_CONFIGURATION: u32 = 0x014;
/// Current address.
pub const CURRENT_IP: u32 = 0x024;
/// Current subnet mask.
pub const CURRENT_MASK: u32 = 0x034;
/// Vendor, 32 bytes.
pub const VENDOR: u32 = 0x048;
/// Model, 32 bytes.
pub const MODEL: u32 = 0x068;
/// Device version, 32 bytes.
pub const DEVICE_VERSION: u32 = 0x088;
/// Free text of the maker, 48 bytes.
pub const INFO: u32 = 0x0a8;
/// Serial number, 16 bytes.
pub const SERIAL: u32 = 0x0d8;
/// Name given by the user, 16 bytes, writable.
pub const USER_NAME: u32 = 0x0e8;
/// Where the GenICam description lies, 512 bytes of text.
pub const FIRST_URL: u32 = 0x200;
/// Number of network interfaces.
pub const INTERFACES: u32 = 0x600;
/// Number of stream channels.
pub const STREAM_CHANNELS: u32 = 0x904;
/// Control commands the device knows.
pub const GVCP_CAPABILITY: u32 = 0x934;
/// Milliseconds without a command after which control is lost, writable.
pub const HEARTBEAT_TIMEOUT: u32 = 0x938;
/// Ticks per second of the device's clock, 64 bits.
pub const TICK_FREQUENCY: u32 = 0x93c;
/// Bit 0 resets the clock, bit 1 latches it.
pub const TIMESTAMP_CONTROL: u32 = 0x944;
/// Latched clock, 64 bits.
pub const TIMESTAMP_VALUE: u32 = 0x948;
/// Control privilege: bit 0 exclusive, bit 1 control.
pub const CONTROL_PRIVILEGE: u32 = 0xa00;
/// UDP port that the stream goes to; 0 is closed.
pub const STREAM_PORT: u32 = 0xd00;
/// Packet size and the bits that go with it.
pub const STREAM_PACKET_SIZE: u32 = 0xd04;
/// Ticks between two stream packets.
pub const STREAM_PACKET_DELAY: u32 = 0xd08;
/// Address that the stream goes to.
pub const STREAM_DESTINATION: u32 = 0xd18;
/// End of the bootstrap registers.
pub(crate) const BOOTSTRAP_END: u32 = 0x1000;
/// First of this device's own registers, outside every slot of the specification.
pub const OWN_REGISTERS: u32 = 0x8000;
/// First byte of the GenICam description.
pub const XML: u32 = 0x1_0000;

/// In [`CONTROL_PRIVILEGE`]: nobody else may even read.
pub const PRIVILEGE_EXCLUSIVE: u32 = 1;
/// In [`CONTROL_PRIVILEGE`]: nobody else may write.
pub const PRIVILEGE_CONTROL: u32 = 2;
/// In [`STREAM_PACKET_SIZE`]: send one packet of this size now. Reads as 0.
pub const FIRE_TEST_PACKET: u32 = 1 << 31;
/// In [`STREAM_PACKET_SIZE`]: packets must not be fragmented.
pub const DO_NOT_FRAGMENT: u32 = 1 << 30;
