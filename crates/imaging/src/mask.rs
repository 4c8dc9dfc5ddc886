//! Which pixels count.

use crate::error::ImagingError;
use crate::image::Image;

/// A set of pixels, stored as 255 inside and 0 outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    image: Image<u8>,
}

impl Mask {
    /// Every pixel that is not zero.
    pub fn from_nonzero(image: &Image<u8>) -> Self {
        Self {
            image: image.map(|&value| if value == 0 { 0 } else { 255 }),
        }
    }

    /// True inside; false outside the set and outside the image.
    pub fn contains(&self, x: usize, y: usize) -> bool {
        self.image.get(x, y).is_some_and(|&value| value != 0)
    }

    /// How many pixels are inside.
    pub fn count(&self) -> usize {
        self.image.pixels().iter().filter(|&&value| value != 0).count()
    }

    /// The mask as a picture, 255 inside and 0 outside.
    pub fn as_image(&self) -> &Image<u8> {
        &self.image
    }

    /// Overwrites every pixel outside the mask.
    pub fn fill_outside<T: Copy>(&self, image: &mut Image<T>, value: T) -> Result<(), ImagingError> {
        self.image.require_size_of(image, "mask")?;
        for (pixel, &inside) in image.pixels_mut().iter_mut().zip(self.image.pixels()) {
            if inside == 0 {
                *pixel = value;
            }
        }
        Ok(())
    }
}
