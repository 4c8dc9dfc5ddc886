//! The pixel formats a monochrome camera of this crate sends.

use crate::GigeVisionError;

/// One linear grey value per pixel, rows from the top, no padding, little endian where it has two bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum PixelFormat {
    /// One byte, 0..=255.
    Mono8 = 0x0108_0001,
    /// Two bytes, 0..=4095.
    Mono12 = 0x0110_0005,
    /// Two bytes, 0..=65535.
    Mono16 = 0x0110_0007,
}

impl PixelFormat {
    /// Every format, in the order of the feature's entries.
    pub const ALL: [Self; 3] = [Self::Mono8, Self::Mono12, Self::Mono16];

    /// The 32-bit code on the wire and in the register.
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// The format of a code.
    pub fn from_code(code: u32) -> Result<Self, GigeVisionError> {
        Self::ALL
            .into_iter()
            .find(|format| format.code() == code)
            .ok_or(GigeVisionError::PixelFormat { found: code })
    }

    /// 1 or 2.
    pub const fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Mono8 => 1,
            Self::Mono12 | Self::Mono16 => 2,
        }
    }

    /// Packs samples over the whole of 16 bits (65535 = saturated) into this format's bytes; low bits are cut off.
    pub fn pack(self, samples: &[u16]) -> Vec<u8> {
        match self {
            Self::Mono8 => samples.iter().map(|sample| (sample >> 8) as u8).collect(),
            Self::Mono12 => samples.iter().flat_map(|sample| (sample >> 4).to_le_bytes()).collect(),
            Self::Mono16 => samples.iter().flat_map(|sample| sample.to_le_bytes()).collect(),
        }
    }
}
