//! The images of one capture: all lights off, then one light at a time.

use std::collections::BTreeMap;

use crate::error::ImagingError;
use crate::image::Image;

/// The channel number under which the dark frame is given.
pub const DARK_CHANNEL: u8 = 0;

/// The dark frame and one image per light, all of one size, linear in the light's energy.
#[derive(Debug, Clone, PartialEq)]
pub struct ExposureStack {
    dark: Image<u16>,
    lights: BTreeMap<u8, Image<u16>>,
    saturation: u16,
}

impl ExposureStack {
    /// Collects a capture given in any order: exactly one image for [`DARK_CHANNEL`] and for each of the `expected`
    /// light channels. A raw value at or above `saturation` has lost its meaning.
    pub fn new(
        expected: &[u8],
        images: impl IntoIterator<Item = (u8, Image<u16>)>,
        saturation: u16,
    ) -> Result<Self, ImagingError> {
        let mut lights = BTreeMap::new();
        for (channel, image) in images {
            if channel != DARK_CHANNEL && !expected.contains(&channel) {
                return Err(ImagingError::UnexpectedChannel {
                    channel,
                    expected: expected.to_vec(),
                });
            }
            if lights.insert(channel, image).is_some() {
                return Err(ImagingError::DuplicateChannel { channel });
            }
        }
        let present: Vec<u8> = lights.keys().copied().collect();
        let wanted = std::iter::once(DARK_CHANNEL).chain(expected.iter().copied());
        let missing: Vec<u8> = wanted.filter(|channel| !present.contains(channel)).collect();
        let Some(dark) = lights.remove(&DARK_CHANNEL).filter(|_| missing.is_empty()) else {
            return Err(ImagingError::MissingChannels { missing, present });
        };
        for (channel, image) in &lights {
            image.require_size_of(&dark, &format!("the image of light channel {channel}"))?;
        }
        Ok(Self {
            dark,
            lights,
            saturation,
        })
    }

    /// All lights off: ambient light and the sensor's offset.
    pub fn dark(&self) -> &Image<u16> {
        &self.dark
    }

    /// The image of one light; ambient light is still in it.
    pub fn light(&self, channel: u8) -> Option<&Image<u16>> {
        self.lights.get(&channel)
    }

    /// The light channels, ascending, without the dark frame.
    pub fn channels(&self) -> impl Iterator<Item = u8> + '_ {
        self.lights.keys().copied()
    }

    /// Raw values from here up are saturated.
    pub fn saturation(&self) -> u16 {
        self.saturation
    }

    /// Columns of every image.
    pub fn width(&self) -> usize {
        self.dark.width()
    }

    /// Rows of every image.
    pub fn height(&self) -> usize {
        self.dark.height()
    }
}
