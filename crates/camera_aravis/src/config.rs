//! Which camera, and how its frames travel.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::time::Duration;

use crate::CameraAravisError;

/// Which camera, and how its frames travel.
///
/// The defaults are for one or two cameras on a link that carries jumbo frames, and for the kernel's own socket
/// buffers; the ranges are what [`CameraConfig::check`] holds the values to.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraConfig {
    /// Serial number, IPv4 address, MAC address or Aravis device id. An address needs no broadcast to open.
    pub guid: String,
    /// Value of `TriggerSource` for [`devices::TriggerMode::Line`], such as "Line0".
    pub trigger_line: String,
    /// Whether frames may be received by a packet socket, past the kernel's UDP. It takes the capability `CAP_NET_RAW`,
    /// and a host that is quiet while the camera is set up; without them, UDP is used. The link's statistics say which
    /// it is.
    pub packet_socket: bool,
    /// Bytes of a stream packet, IP and UDP headers included. The network must carry it whole.
    pub packet_size: u32,
    /// Pause of the camera between two packets when they are received over UDP. With the packet socket it is half of
    /// that.
    pub packet_delay: Duration,
    /// Bytes of the UDP socket's buffer, of which the kernel grants `net.core.rmem_max` at most (and then as much again
    /// for its own accounts); all that it grants when `None`.
    pub socket_buffer: Option<u32>,
    /// A frame of which nothing came for this long is given up.
    pub frame_retention: Duration,
    /// A packet that was overtaken by others for this long is asked for again.
    pub packet_patience: Duration,
    /// A packet that was asked for and has not come for this long is asked for once more.
    pub resend_patience: Duration,
    /// The camera frees itself from a host that was silent for this long.
    pub heartbeat: Duration,
    /// Pause between two attempts to open the camera.
    pub retry: Duration,
    /// Frames that can be received before the first is taken.
    pub buffers: usize,
}

impl CameraConfig {
    /// Bytes allowed in a packet.
    pub const PACKET_SIZE: RangeInclusive<u32> = 576..=65_000;
    /// Pause allowed between packets.
    pub const PACKET_DELAY: RangeInclusive<Duration> = Duration::ZERO..=Duration::from_millis(10);
    /// Bytes allowed in the socket's buffer.
    pub const SOCKET_BUFFER: RangeInclusive<u32> = 4096..=0x4000_0000;
    /// Time allowed to a frame of which nothing comes.
    pub const FRAME_RETENTION: RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(10);
    /// Time allowed before a missing packet is asked for.
    pub const PACKET_PATIENCE: RangeInclusive<Duration> = Duration::ZERO..=Duration::from_millis(100);
    /// Time allowed before a missing packet is asked for again.
    pub const RESEND_PATIENCE: RangeInclusive<Duration> = Duration::from_millis(1)..=Duration::from_secs(1);
    /// Silence allowed; Aravis speaks once a second.
    pub const HEARTBEAT: RangeInclusive<Duration> = Duration::from_secs(2)..=Duration::from_mins(1);
    /// Pause allowed between attempts to open.
    pub const RETRY: RangeInclusive<Duration> = Duration::from_millis(100)..=Duration::from_secs(5);
    /// Number of buffers allowed.
    pub const BUFFERS: RangeInclusive<usize> = 2..=64;

    /// The defaults, for this camera.
    pub fn new(guid: impl Into<String>) -> Self {
        Self {
            guid: guid.into(),
            trigger_line: "Line0".into(),
            packet_socket: false,
            packet_size: 7600,
            packet_delay: Duration::from_micros(20),
            socket_buffer: None,
            frame_retention: Duration::from_millis(200),
            packet_patience: Duration::from_millis(1),
            resend_patience: Duration::from_millis(10),
            heartbeat: Duration::from_secs(3),
            retry: Duration::from_secs(1),
            buffers: 16,
        }
    }

    /// Holds every value to its range.
    pub fn check(&self) -> Result<(), CameraAravisError> {
        for (field, value) in [("guid", &self.guid), ("trigger_line", &self.trigger_line)] {
            if value.trim().is_empty() || value.contains('\0') {
                return Err(refuse(field, format!("{value:?}"), "a name that is not empty".into()));
            }
        }
        within("packet_size", self.packet_size, &Self::PACKET_SIZE)?;
        if let Some(bytes) = self.socket_buffer {
            within("socket_buffer", bytes, &Self::SOCKET_BUFFER)?;
        }
        within("buffers", self.buffers, &Self::BUFFERS)?;
        for (field, value, range) in [
            ("packet_delay", self.packet_delay, Self::PACKET_DELAY),
            ("frame_retention", self.frame_retention, Self::FRAME_RETENTION),
            ("packet_patience", self.packet_patience, Self::PACKET_PATIENCE),
            ("resend_patience", self.resend_patience, Self::RESEND_PATIENCE),
            ("heartbeat", self.heartbeat, Self::HEARTBEAT),
            ("retry", self.retry, Self::RETRY),
        ] {
            if !range.contains(&value) {
                let allowed = format!("{:?} to {:?}", range.start(), range.end());
                return Err(refuse(field, format!("{value:?}"), allowed));
            }
        }
        Ok(())
    }

    /// The camera's address, when that is what it is called by.
    #[cfg(feature = "aravis")]
    pub(crate) fn address(&self) -> Option<std::net::Ipv4Addr> {
        self.guid.trim().parse().ok()
    }
}

fn within<T: PartialOrd + Display + Copy>(
    field: &'static str,
    value: T,
    range: &RangeInclusive<T>,
) -> Result<(), CameraAravisError> {
    if range.contains(&value) {
        return Ok(());
    }
    let allowed = format!("{} to {}", range.start(), range.end());
    Err(refuse(field, value.to_string(), allowed))
}

fn refuse(field: &'static str, value: String, allowed: String) -> CameraAravisError {
    CameraAravisError::Config { field, value, allowed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_within_the_ranges() {
        CameraConfig::new("127.0.0.2").check().unwrap();
    }

    #[test]
    fn a_value_out_of_range_is_named_with_what_is_allowed() {
        let refused = |config: CameraConfig| config.check().unwrap_err().to_string();
        let good = || CameraConfig::new("C1");
        assert_eq!(
            refused(CameraConfig {
                packet_size: 100,
                ..good()
            }),
            "packet_size = 100 is not allowed; allowed: 576 to 65000"
        );
        assert_eq!(
            refused(CameraConfig {
                heartbeat: Duration::from_millis(500),
                ..good()
            }),
            "heartbeat = 500ms is not allowed; allowed: 2s to 60s"
        );
        assert!(refused(CameraConfig::new(" ")).contains("guid"));
    }
}
