//! Names and addresses of the device's own registers.

use crate::bootstrap as at;

/// The device's own registers, four bytes each, in the order of their addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Register {
    /// Columns of the sensor.
    SensorWidth,
    /// Rows of the sensor.
    SensorHeight,
    /// Columns that are added up.
    BinningHorizontal,
    /// Rows that are added up.
    BinningVertical,
    /// Columns of the image.
    Width,
    /// Rows of the image.
    Height,
    /// First column.
    OffsetX,
    /// First row.
    OffsetY,
    /// A [`PixelFormat`](crate::PixelFormat) code.
    PixelFormat,
    /// 0 continuous, 1 single frame, 2 multi frame.
    AcquisitionMode,
    /// Command.
    AcquisitionStart,
    /// Command.
    AcquisitionStop,
    /// Frames of a multi-frame acquisition.
    AcquisitionFrameCount,
    /// Millihertz, when no trigger is used.
    AcquisitionFrameRate,
    /// 0 frame start.
    TriggerSelector,
    /// 0 off, 1 on.
    TriggerMode,
    /// 0 software, 1 line 0.
    TriggerSource,
    /// 0 rising edge.
    TriggerActivation,
    /// Command.
    TriggerSoftware,
    /// 0 off.
    ExposureAuto,
    /// Nanoseconds.
    ExposureTime,
    /// 0 off.
    GainAuto,
    /// Millidecibels.
    Gain,
    /// Sixteen-bit grey values that are added.
    BlackLevel,
    /// 1 while a client streams.
    TlParamsLocked,
}

/// Number of own registers.
pub(crate) const REGISTER_COUNT: usize = Register::TlParamsLocked as usize + 1;

impl Register {
    /// Its address.
    pub const fn address(self) -> u32 {
        at::OWN_REGISTERS + 4 * self as u32
    }
}
