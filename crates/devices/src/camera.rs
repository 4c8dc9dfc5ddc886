//! A camera.

use std::time::{Duration, Instant};

use bytes::Bytes;
use futures::future::BoxFuture;
use tokio::sync::{mpsc, watch};

/// A camera with linear 16-bit pixels and a trigger. It is opened, and opened again after a loss, by its driver.
pub trait Camera: Send + Sync {
    /// Applies settings, all of them or none; fails while frames are awaited.
    fn configure(&self, settings: CameraSettings) -> BoxFuture<'_, Result<AppliedSettings, CameraError>>;

    /// Throws away every frame that came unasked, and gives those that are exposed from now on, `count` of them at
    /// most. The camera listens to its trigger when this returns. Frames come in order; a frame that is lost or damaged
    /// is a [`FrameFault`] in its place. Dropping [`Frames`] ends it; arming again does too.
    fn arm(&self, count: usize) -> BoxFuture<'_, Result<Frames, CameraError>>;

    /// One software trigger; only in [`TriggerMode::Software`].
    fn trigger(&self) -> BoxFuture<'_, Result<(), CameraError>>;

    /// Whether the camera is there; changes wake the receiver.
    fn link(&self) -> watch::Receiver<CameraLink>;
}

/// Frames of an armed camera. Ends (`None`) after the last one, or when the camera is lost.
pub type Frames = mpsc::UnboundedReceiver<FrameEvent>;

/// What starts an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TriggerMode {
    /// The rising edge of the camera's hardware line.
    Line,
    /// [`Camera::trigger`].
    Software,
}

/// A part of the sensor, pixels after binning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Sensor pixels that become one, in each direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Binning {
    /// Columns, at least 1.
    pub horizontal: u32,
    /// Rows, at least 1.
    pub vertical: u32,
}

/// How images are taken. Automatic exposure, gain and gamma are always off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraSettings {
    /// The whole sensor when `None`.
    pub region: Option<Region>,
    /// Whole pixels when 1 x 1.
    pub binning: Binning,
    /// How long the sensor collects light.
    pub exposure: Duration,
    /// Amplification, dB.
    pub gain_db: f64,
    /// Added to every pixel, digital numbers of 16 bits.
    pub black_level: f64,
    /// What starts an exposure.
    pub trigger: TriggerMode,
}

/// What the camera made of the settings: it rounds exposure and gain to its steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AppliedSettings {
    /// As the camera reads them back.
    pub settings: CameraSettings,
    /// Columns of an image.
    pub width: u32,
    /// Rows of an image.
    pub height: u32,
}

/// Who the camera says it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraIdentity {
    /// Maker.
    pub vendor: String,
    /// Model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Where it is on the network, such as "127.0.0.2".
    pub address: String,
}

/// Whether the camera is there.
#[derive(Debug, Clone, PartialEq)]
pub enum CameraLink {
    /// It is not; the driver keeps trying.
    Lost {
        /// What was tried and what came of it, for people.
        reason: String,
    },
    /// It is open and under our control.
    Open {
        /// Who it is.
        identity: CameraIdentity,
        /// Frames received whole, lost or damaged, and packets sent again, since it was opened; for diagnostics.
        statistics: Vec<(String, u64)>,
    },
}

/// What came of one trigger.
#[derive(Debug, Clone)]
pub enum FrameEvent {
    /// An image.
    Frame(Frame),
    /// None: it is missing or not whole.
    Fault(FrameFault),
}

/// An image, whole and as it was asked for.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Position among the frames since the camera was armed, from 0.
    pub index: usize,
    /// Start of exposure on the camera's own clock, since its zero.
    pub exposed_at: Duration,
    /// When its last packet was here.
    pub received_at: Instant,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// 16-bit little-endian grey values, rows from the top without padding.
    pub pixels: Bytes,
}

/// A trigger without a usable image.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameFault {
    /// The camera counted frames that never arrived.
    #[error("{count} frames before this one are missing")]
    Missing {
        /// How many.
        count: u64,
    },
    /// Packets were lost and did not come again in time.
    #[error("the frame did not arrive whole: {status}")]
    Incomplete {
        /// As the camera library says.
        status: String,
    },
    /// Not the size that was set.
    #[error("a frame of {found} bytes, {expected} are right for {width} x {height} pixels of 16 bits")]
    Size {
        /// Bytes that came.
        found: usize,
        /// Bytes that were asked for.
        expected: usize,
        /// Columns that were asked for.
        width: u32,
        /// Rows that were asked for.
        height: u32,
    },
    /// Not the format that was set.
    #[error("a frame of pixel format {found}, {expected} was set")]
    Format {
        /// GenICam name or code.
        found: String,
        /// GenICam name.
        expected: &'static str,
    },
}

/// Why a camera did not do what was asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// It is not there.
    #[error("camera {guid} is not open: {reason}")]
    Lost {
        /// Its configured serial number or address.
        guid: String,
        /// What was tried and what came of it.
        reason: String,
    },
    /// The camera refused a setting.
    #[error("camera {guid}: {feature} = {value} is refused: {reason}")]
    Setting {
        /// Its configured serial number or address.
        guid: String,
        /// GenICam name of the feature.
        feature: String,
        /// As asked for.
        value: String,
        /// As the camera or its description says, with the values allowed.
        reason: String,
    },
    /// Something else went wrong in the camera or its library.
    #[error("camera {guid}: {action} failed: {reason}")]
    Failed {
        /// Its configured serial number or address.
        guid: String,
        /// What was being done.
        action: &'static str,
        /// As the library says.
        reason: String,
    },
    /// Frames are awaited.
    #[error("camera {guid} is armed; settings change between captures")]
    Armed {
        /// Its configured serial number or address.
        guid: String,
    },
}
