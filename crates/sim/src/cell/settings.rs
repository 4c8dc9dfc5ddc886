//! What a client has set a camera to.

use std::time::Duration;

use gige_vision::{FrameRequest, PixelFormat, Register, Server};

use super::gallery::Binning;
use crate::sensor::Region;

/// Everything of a camera's settings that shows in its images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Settings {
    pub(super) exposure: Duration,
    pub(super) gain_millidecibels: u32,
    pub(super) black_level: u32,
    pub(super) pixel_format: PixelFormat,
    pub(super) binning: Binning,
    pub(super) region: Region,
}

impl Settings {
    /// Of a frame that is wanted.
    pub(super) fn of_request(request: &FrameRequest) -> Self {
        Self {
            exposure: request.exposure,
            gain_millidecibels: (request.gain_decibels * 1000.0).round() as u32,
            black_level: request.black_level,
            pixel_format: request.pixel_format,
            binning: [request.binning.0, request.binning.1],
            region: Region {
                x: request.offset_x as usize,
                y: request.offset_y as usize,
                width: request.width as usize,
                height: request.height as usize,
            },
        }
    }

    /// Of the frames that will be wanted.
    pub(super) fn of_server(server: &Server) -> Option<Self> {
        let pixels = |register| server.register(register) as usize;
        Some(Self {
            exposure: Duration::from_nanos(u64::from(server.register(Register::ExposureTime))),
            gain_millidecibels: server.register(Register::Gain),
            black_level: server.register(Register::BlackLevel),
            pixel_format: PixelFormat::from_code(server.register(Register::PixelFormat)).ok()?,
            binning: [
                server.register(Register::BinningHorizontal),
                server.register(Register::BinningVertical),
            ],
            region: Region {
                x: pixels(Register::OffsetX),
                y: pixels(Register::OffsetY),
                width: pixels(Register::Width),
                height: pixels(Register::Height),
            },
        })
    }
}
