//! Where images come from.

use std::time::Duration;

use bytes::Bytes;

use crate::PixelFormat;

/// One exposure that an image is wanted for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameRequest {
    /// Start of exposure, device time.
    pub triggered_at: Duration,
    /// How long the sensor collects light.
    pub exposure: Duration,
    /// Amplification before quantisation, 0..=24 dB.
    pub gain_decibels: f64,
    /// Sixteen-bit grey values to add, 0..=4095.
    pub black_level: u32,
    /// Format of the bytes wanted.
    pub pixel_format: PixelFormat,
    /// Columns wanted, after binning.
    pub width: u32,
    /// Rows wanted, after binning.
    pub height: u32,
    /// First column, after binning.
    pub offset_x: u32,
    /// First row, after binning.
    pub offset_y: u32,
    /// Sensor columns and rows averaged into one pixel.
    pub binning: (u32, u32),
    /// Frames since acquisition started, from 0.
    pub index: u32,
    /// Which acquisition it belongs to.
    pub(crate) acquisition: u64,
}

impl FrameRequest {
    /// Bytes the image must have.
    pub fn image_bytes(&self) -> usize {
        self.width as usize * self.height as usize * self.pixel_format.bytes_per_pixel()
    }
}

/// Gives the image of an exposure; called after its end, in the order of the triggers.
pub trait FrameSource: Send {
    /// Exactly [`FrameRequest::image_bytes`] bytes: rows from the top, no padding, in the format wanted.
    fn frame(&mut self, request: &FrameRequest) -> Bytes;
}

impl<F: FnMut(&FrameRequest) -> Bytes + Send> FrameSource for F {
    fn frame(&mut self, request: &FrameRequest) -> Bytes {
        self(request)
    }
}
