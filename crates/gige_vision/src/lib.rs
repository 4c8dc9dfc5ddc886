//! A GigE Vision camera in software, for tests and for the simulated cell: a client such as Aravis finds it, reads its
//! GenICam description, takes control, sets features, triggers it and receives its frames over UDP, lost packets and
//! all. It is not a driver, knows no client library, and does not render: images come from a [`FrameSource`].
//!
//! [`Device`] is the camera without sockets or clock: datagrams and times go in, datagrams and exposures come out.
//! [`Server`] runs one over UDP with three plain threads.
//!
//! ```
//! use std::net::Ipv4Addr;
//! use std::time::Instant;
//!
//! use gige_vision::{DeviceConfig, FrameRequest, Server};
//!
//! let config = DeviceConfig::new("C1", Ipv4Addr::new(127, 0, 41, 1));
//! let source = |request: &FrameRequest| vec![0; request.image_bytes()].into();
//! let server = Server::start_on_port(&config, 0, source)?;
//! println!("control port at {}", server.address());
//! server.line_trigger(Instant::now()); // a frame, once a client has started acquisition with TriggerSource Line0
//! assert_eq!(server.counters().triggers_ignored, 1);
//! # Ok::<(), gige_vision::GigeVisionError>(())
//! ```
//!
//! # Packets
//!
//! Everything is big endian, except pixels of two bytes, which are little endian.
//!
//! Control (GVCP, UDP port 3956): `0x42`, flags, command (16 bits), length of body (16), request id (16), body. Answers
//! begin with `0x0000`, or with `0x80` and the reason of a [`Refusal`], and carry the command's code plus one.
//!
//! | command | body | answer |
//! |---|---|---|
//! | `0x0002` DISCOVERY | | the first 248 bytes of the registers |
//! | `0x0080` READREG | addresses | values |
//! | `0x0082` WRITEREG | (address, value) | number written |
//! | `0x0084` READMEM | address, count | address, data |
//! | `0x0086` WRITEMEM | address, data | address |
//! | `0x0040` PACKETRESEND | block id, first packet, last packet | the packets, on the stream |
//!
//! Stream (GVSP): status (16 bits), block id (16, never 0), content type (8), packet id (24), content.
//!
//! | content type | packet ids | content |
//! |---|---|---|
//! | 1 leader | 0 | stamp of the start of exposure in ns, [`PixelFormat`], width, height, offsets |
//! | 3 payload | 1..=N | packet size - 36 bytes of image; the last one shorter |
//! | 2 trailer | N + 1 | rows |
//!
//! # Registers
//!
//! | address | access | what |
//! |---|---|---|
//! | `0x0000`..`0x00f8` | read | identity; the user name at `0x00e8` can be written |
//! | `0x0200` | read | where the GenICam description lies (plain XML at `0x10000`) |
//! | `0x0938` | write | heartbeat timeout, 500..=600000 ms, default 3000 |
//! | `0x0944`, `0x0948` | write, read | clock control (1 reset, 2 latch), latched clock in ns |
//! | `0x0a00` | write | control privilege: 2 control, 1 exclusive, 0 release |
//! | `0x0d00`, `0x0d18` | write | port and address the stream goes to |
//! | `0x0d04` | write | packet size 576..=65000 with IP and UDP headers; bit 31 sends one test packet |
//! | `0x0d08` | write | nanoseconds between two packets, at most 10 ms |
//! | `0x8000`.. | both | the device's own registers, in the order of [`Register`] |
//!
//! Who does not hold control reads, and is refused writes with [`Refusal::AccessDenied`]; under exclusive control it is
//! refused reads too. The region, binning and pixel format cannot be written during an acquisition.

pub mod bootstrap;
mod config;
mod device;
mod error;
mod features;
mod frame_source;
mod genicam;
pub mod gvcp;
pub mod gvsp;
mod pixel_format;
mod register;
mod server;
mod transmit;
mod wire;

pub use config::{Counters, DeviceConfig, Faults};
pub use device::{Device, Step};
pub use error::GigeVisionError;
pub use frame_source::{FrameRequest, FrameSource};
pub use gvcp::Refusal;
pub use pixel_format::PixelFormat;
pub use register::Register;
pub use server::Server;
