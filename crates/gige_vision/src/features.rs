//! The one table of features: registers, ranges and the GenICam description come from it.

use crate::bootstrap as at;
use crate::register::REGISTER_COUNT;
use crate::{PixelFormat, Register};

/// Entry of [`Register::AcquisitionMode`].
pub(crate) const MODE_SINGLE_FRAME: u32 = 1;
/// Entry of [`Register::AcquisitionMode`].
pub(crate) const MODE_MULTI_FRAME: u32 = 2;
/// Entry of [`Register::TriggerSource`].
pub(crate) const SOURCE_SOFTWARE: u32 = 0;
/// Entry of [`Register::TriggerSource`].
pub(crate) const SOURCE_LINE0: u32 = 1;
/// Registers count nanoseconds, millidecibels and millihertz.
const THOUSAND: u32 = 1000;

/// What kind of value a feature is.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind {
    /// `most` is for the description; `limit` names the node that computes it where it depends on others.
    Integer {
        least: u32,
        most: u32,
        step: u32,
        limit: Option<&'static str>,
    },
    /// The register counts `per_unit` of the unit; the range is the register's.
    Float {
        per_unit: u32,
        unit: &'static str,
        least: u32,
        most: u32,
    },
    Enumeration(&'static [(&'static str, u32)]),
    Command(u32),
    Text(u32),
    /// A read-only integer of 64 bits.
    Wide,
    /// Bits of a register, numbered from the least.
    Bits {
        lowest: u32,
        highest: u32,
        least: u32,
        most: u32,
    },
    Flag(u32),
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Feature {
    pub(crate) name: &'static str,
    pub(crate) category: &'static str,
    pub(crate) tooltip: &'static str,
    pub(crate) address: u32,
    pub(crate) writable: bool,
    /// Not to be changed while frames are being acquired.
    pub(crate) locked: bool,
    pub(crate) initial: u32,
    pub(crate) kind: Kind,
}

pub(crate) const CATEGORIES: [&str; 5] = [DEVICE, IMAGE, ACQUISITION, ANALOG, TRANSPORT];
const DEVICE: &str = "DeviceControl";
const IMAGE: &str = "ImageFormatControl";
const ACQUISITION: &str = "AcquisitionControl";
const ANALOG: &str = "AnalogControl";
const TRANSPORT: &str = "TransportLayerControl";

const fn own(register: Register, name: &'static str, category: &'static str, tooltip: &'static str) -> Feature {
    Feature {
        name,
        category,
        tooltip,
        address: register.address(),
        writable: true,
        locked: false,
        initial: 0,
        kind: Kind::Wide,
    }
}

const fn bootstrap(
    address: u32,
    name: &'static str,
    category: &'static str,
    tooltip: &'static str,
    kind: Kind,
) -> Feature {
    Feature {
        name,
        category,
        tooltip,
        address,
        writable: true,
        locked: false,
        initial: 0,
        kind,
    }
}

impl Feature {
    const fn integer(mut self, least: u32, most: u32, step: u32) -> Self {
        self.kind = Kind::Integer {
            least,
            most,
            step,
            limit: None,
        };
        self.initial = least;
        self
    }

    const fn size(mut self, least: u32, step: u32, node: &'static str) -> Self {
        self.kind = Kind::Integer {
            least,
            most: u32::MAX,
            step,
            limit: Some(node),
        };
        self.initial = least;
        self
    }

    const fn float(mut self, per_unit: u32, unit: &'static str, least: u32, most: u32, initial: u32) -> Self {
        self.kind = Kind::Float {
            per_unit,
            unit,
            least,
            most,
        };
        self.initial = initial;
        self
    }

    const fn entries(mut self, entries: &'static [(&'static str, u32)]) -> Self {
        self.kind = Kind::Enumeration(entries);
        self.initial = entries[0].1;
        self
    }

    const fn command(mut self) -> Self {
        self.kind = Kind::Command(1);
        self
    }

    const fn read_only(mut self) -> Self {
        self.writable = false;
        self
    }

    const fn locked(mut self) -> Self {
        self.locked = true;
        self
    }
}

const OFF: &[(&str, u32)] = &[("Off", 0)];
const PIXEL_FORMATS: &[(&str, u32)] = &[
    ("Mono16", PixelFormat::Mono16.code()),
    ("Mono12", PixelFormat::Mono12.code()),
    ("Mono8", PixelFormat::Mono8.code()),
];
const MODES: &[(&str, u32)] = &[
    ("Continuous", 0),
    ("SingleFrame", MODE_SINGLE_FRAME),
    ("MultiFrame", MODE_MULTI_FRAME),
];
const SOURCES: &[(&str, u32)] = &[("Software", SOURCE_SOFTWARE), ("Line0", SOURCE_LINE0)];
/// Side of the smallest image.
pub(crate) const LEAST_SIDE: u32 = 16;
/// Columns come in fours, so that a row of any format is a whole number of words.
pub(crate) const COLUMN_STEP: u32 = 4;
/// Largest stream packet, IP and UDP headers included; one datagram on loopback holds it.
pub(crate) const MOST_PACKET_SIZE: u32 = 65000;
/// Smallest stream packet, as every IPv4 host must take it.
pub(crate) const LEAST_PACKET_SIZE: u32 = 576;
/// Heartbeat timeouts a client may ask for, in milliseconds.
pub(crate) const HEARTBEAT_MILLIS: (u32, u32) = (500, 600_000);
/// Longest inter-packet delay: 10 ms.
pub(crate) const MOST_PACKET_DELAY: u32 = 10_000_000;

/// Own registers first, in the order of [`Register`].
pub(crate) const FEATURES: &[Feature] = &[
    own(Register::SensorWidth, "SensorWidth", IMAGE, "Columns of the sensor")
        .integer(0, 8192, 1)
        .read_only(),
    own(Register::SensorHeight, "SensorHeight", IMAGE, "Rows of the sensor")
        .integer(0, 8192, 1)
        .read_only(),
    own(
        Register::BinningHorizontal,
        "BinningHorizontal",
        IMAGE,
        "Columns averaged into one",
    )
    .integer(1, 4, 1)
    .locked(),
    own(
        Register::BinningVertical,
        "BinningVertical",
        IMAGE,
        "Rows averaged into one",
    )
    .integer(1, 4, 1)
    .locked(),
    own(Register::Width, "Width", IMAGE, "Columns of the image")
        .size(LEAST_SIDE, COLUMN_STEP, "WidthLimit")
        .locked(),
    own(Register::Height, "Height", IMAGE, "Rows of the image")
        .size(LEAST_SIDE, 1, "HeightLimit")
        .locked(),
    own(Register::OffsetX, "OffsetX", IMAGE, "First column of the image")
        .size(0, COLUMN_STEP, "OffsetXLimit")
        .locked(),
    own(Register::OffsetY, "OffsetY", IMAGE, "First row of the image")
        .size(0, 1, "OffsetYLimit")
        .locked(),
    own(Register::PixelFormat, "PixelFormat", IMAGE, "Bytes of a pixel")
        .entries(PIXEL_FORMATS)
        .locked(),
    own(
        Register::AcquisitionMode,
        "AcquisitionMode",
        ACQUISITION,
        "When acquisition ends by itself",
    )
    .entries(MODES),
    own(
        Register::AcquisitionStart,
        "AcquisitionStart",
        ACQUISITION,
        "Starts acquisition",
    )
    .command(),
    own(
        Register::AcquisitionStop,
        "AcquisitionStop",
        ACQUISITION,
        "Ends acquisition",
    )
    .command(),
    own(
        Register::AcquisitionFrameCount,
        "AcquisitionFrameCount",
        ACQUISITION,
        "Frames in mode MultiFrame",
    )
    .integer(1, 65535, 1),
    own(
        Register::AcquisitionFrameRate,
        "AcquisitionFrameRate",
        ACQUISITION,
        "Frames per second without trigger",
    )
    .float(THOUSAND, "Hz", 100, 500_000, 10_000),
    own(
        Register::TriggerSelector,
        "TriggerSelector",
        ACQUISITION,
        "What a trigger starts",
    )
    .entries(&[("FrameStart", 0)]),
    own(
        Register::TriggerMode,
        "TriggerMode",
        ACQUISITION,
        "Whether frames wait for the trigger",
    )
    .entries(&[("Off", 0), ("On", 1)]),
    own(
        Register::TriggerSource,
        "TriggerSource",
        ACQUISITION,
        "Where the trigger comes from",
    )
    .entries(SOURCES),
    own(
        Register::TriggerActivation,
        "TriggerActivation",
        ACQUISITION,
        "Edge that counts",
    )
    .entries(&[("RisingEdge", 0)]),
    own(
        Register::TriggerSoftware,
        "TriggerSoftware",
        ACQUISITION,
        "Triggers one frame",
    )
    .command(),
    own(
        Register::ExposureAuto,
        "ExposureAuto",
        ACQUISITION,
        "Automatic exposure",
    )
    .entries(OFF),
    own(
        Register::ExposureTime,
        "ExposureTime",
        ACQUISITION,
        "Time the sensor collects light",
    )
    .float(THOUSAND, "us", 10_000, 1_000_000_000, 2_500_000),
    own(Register::GainAuto, "GainAuto", ANALOG, "Automatic gain").entries(OFF),
    own(Register::Gain, "Gain", ANALOG, "Amplification before quantisation").float(THOUSAND, "dB", 0, 24_000, 0),
    own(
        Register::BlackLevel,
        "BlackLevel",
        ANALOG,
        "Added to every pixel, in sixteen-bit grey values",
    )
    .float(1, "DN", 0, 4095, 0),
    own(
        Register::TlParamsLocked,
        "TLParamsLocked",
        TRANSPORT,
        "1 while a client streams",
    )
    .integer(0, 1, 1),
    bootstrap(at::VENDOR, "DeviceVendorName", DEVICE, "Maker", Kind::Text(32)).read_only(),
    bootstrap(at::MODEL, "DeviceModelName", DEVICE, "Model", Kind::Text(32)).read_only(),
    bootstrap(at::DEVICE_VERSION, "DeviceVersion", DEVICE, "Version", Kind::Text(32)).read_only(),
    bootstrap(
        at::INFO,
        "DeviceManufacturerInfo",
        DEVICE,
        "What this device is",
        Kind::Text(48),
    )
    .read_only(),
    bootstrap(
        at::SERIAL,
        "DeviceSerialNumber",
        DEVICE,
        "Serial number",
        Kind::Text(16),
    )
    .read_only(),
    bootstrap(
        at::USER_NAME,
        "DeviceUserID",
        DEVICE,
        "Name given by the user",
        Kind::Text(16),
    ),
    bootstrap(
        at::TIMESTAMP_CONTROL,
        "TimestampLatch",
        DEVICE,
        "Latches the clock",
        Kind::Command(2),
    ),
    bootstrap(
        at::TIMESTAMP_VALUE,
        "TimestampLatchValue",
        DEVICE,
        "The latched clock, in ns",
        Kind::Wide,
    )
    .read_only(),
    bootstrap(
        at::TICK_FREQUENCY,
        "GevTimestampTickFrequency",
        TRANSPORT,
        "Ticks per second",
        Kind::Wide,
    )
    .read_only(),
    bootstrap(
        at::HEARTBEAT_TIMEOUT,
        "GevHeartbeatTimeout",
        TRANSPORT,
        "Silence in ms after which control is lost",
        Kind::Integer {
            least: HEARTBEAT_MILLIS.0,
            most: HEARTBEAT_MILLIS.1,
            step: 1,
            limit: None,
        },
    ),
    bootstrap(
        at::STREAM_PACKET_SIZE,
        "GevSCPSPacketSize",
        TRANSPORT,
        "Bytes of a stream packet with its IP and UDP headers",
        Kind::Bits {
            lowest: 0,
            highest: 15,
            least: LEAST_PACKET_SIZE,
            most: MOST_PACKET_SIZE,
        },
    ),
    bootstrap(
        at::STREAM_PACKET_SIZE,
        "GevSCPSFireTestPacket",
        TRANSPORT,
        "Sends one packet of this size",
        Kind::Flag(31),
    ),
    bootstrap(
        at::STREAM_PACKET_SIZE,
        "GevSCPSDoNotFragment",
        TRANSPORT,
        "Packets are never fragmented",
        Kind::Flag(30),
    ),
    bootstrap(
        at::STREAM_PACKET_DELAY,
        "GevSCPD",
        TRANSPORT,
        "Ticks (ns) between two stream packets",
        Kind::Integer {
            least: 0,
            most: MOST_PACKET_DELAY,
            step: 1,
            limit: None,
        },
    ),
];

/// The feature that is an own register at this address.
pub(crate) fn own_feature(address: u32) -> Option<(usize, &'static Feature)> {
    let index = address.checked_sub(at::OWN_REGISTERS)? as usize / 4;
    (index < REGISTER_COUNT).then(|| (index, &FEATURES[index]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_registers_come_first_and_in_the_order_of_their_addresses() {
        for (index, feature) in FEATURES.iter().enumerate() {
            let expected = at::OWN_REGISTERS + 4 * index as u32;
            assert_eq!(index < REGISTER_COUNT, feature.address == expected, "{}", feature.name);
        }
    }

    #[test]
    fn names_are_distinct_and_categories_known() {
        for (index, feature) in FEATURES.iter().enumerate() {
            assert!(CATEGORIES.contains(&feature.category));
            assert!(
                FEATURES[..index].iter().all(|other| other.name != feature.name),
                "{}",
                feature.name
            );
        }
    }
}
