//! Who the device is, and what is wrong with it on purpose.

use std::net::Ipv4Addr;
use std::time::Duration;

use crate::GigeVisionError;
use crate::features::{COLUMN_STEP, LEAST_SIDE};

/// Largest sensor side; also what the description says.
const MOST_SIDE: u32 = 8192;

/// Identity and sensor of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceConfig {
    /// Maker, up to 31 ASCII characters.
    pub vendor: String,
    /// Model, up to 31 ASCII characters.
    pub model: String,
    /// Serial number, up to 15 ASCII characters; distinct for every device on a network.
    pub serial: String,
    /// Name given by the user, up to 15 ASCII characters; a client may change it.
    pub user_name: String,
    /// Columns of the sensor, a multiple of 4 in 16..=8192.
    pub sensor_width: u32,
    /// Rows of the sensor, a multiple of 4 in 16..=8192.
    pub sensor_height: u32,
    /// The address clients reach the device at; registers tell it.
    pub ip: Ipv4Addr,
}

impl DeviceConfig {
    /// A Rakelight camera of 1536 x 1536 pixels.
    pub fn new(serial: impl Into<String>, ip: Ipv4Addr) -> Self {
        Self {
            vendor: "Rakelight".into(),
            model: "Simulated".into(),
            serial: serial.into(),
            user_name: "camera".into(),
            sensor_width: 1536,
            sensor_height: 1536,
            ip,
        }
    }

    pub(crate) fn check(&self) -> Result<(), GigeVisionError> {
        for (field, value, allowed) in [
            ("vendor", &self.vendor, 31),
            ("model", &self.model, 31),
            ("serial", &self.serial, 15),
            ("user_name", &self.user_name, 15),
        ] {
            if value.is_empty() || value.len() > allowed || !value.is_ascii() {
                return Err(GigeVisionError::Name {
                    field,
                    value: value.clone(),
                    allowed,
                });
            }
        }
        let (width, height) = (self.sensor_width, self.sensor_height);
        let fits = |side: u32| (LEAST_SIDE..=MOST_SIDE).contains(&side) && side.is_multiple_of(COLUMN_STEP);
        if !fits(width) || !fits(height) {
            return Err(GigeVisionError::SensorSize { width, height });
        }
        Ok(())
    }
}

/// What goes wrong on purpose. The default is nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// Share of stream packets (resent ones too) that get lost, 0..=1.
    pub drop_ratio: f64,
    /// Which ones: the same seed loses the same packets.
    pub drop_seed: u64,
    /// Frames leave this much late.
    pub frame_delay: Duration,
    /// As with the cable pulled out: nothing is heard and nothing is said.
    pub muted: bool,
    /// Frames have half their rows.
    pub short_frames: bool,
    /// Frames announce another pixel format than they were asked for.
    pub wrong_pixel_format: bool,
}

/// What has happened since the device was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Frames whose trailer has left.
    pub frames_sent: u64,
    /// Stream packets that left, without resent ones.
    pub packets_sent: u64,
    /// Stream packets sent again.
    pub packets_resent: u64,
    /// Stream packets lost on purpose.
    pub packets_dropped: u64,
    /// Triggers that fell into an exposure, or that nobody waited for.
    pub triggers_ignored: u64,
    /// Images of the wrong size that the source gave.
    pub images_refused: u64,
    /// Datagrams to the control port that are no command.
    pub malformed_commands: u64,
    /// Times a client lost control by its silence.
    pub heartbeats_lost: u64,
    /// Datagrams the system would not send.
    pub send_errors: u64,
}
