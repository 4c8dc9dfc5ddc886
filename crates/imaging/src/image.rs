//! Images as contiguous rows of pixels.

use crate::error::ImagingError;

/// What an image may be made of: plain numbers without padding, alone or in threes.
pub trait Pixel: bytemuck::Pod + Send + Sync {
    /// The same pixel with the bytes of each of its numbers reversed.
    #[must_use]
    fn swap_bytes(self) -> Self;
}

impl Pixel for u8 {
    fn swap_bytes(self) -> Self {
        self
    }
}

impl Pixel for u16 {
    fn swap_bytes(self) -> Self {
        u16::swap_bytes(self)
    }
}

impl Pixel for f32 {
    fn swap_bytes(self) -> Self {
        f32::from_bits(self.to_bits().swap_bytes())
    }
}

impl<T: Pixel> Pixel for [T; 3]
where
    [T; 3]: bytemuck::Pod,
{
    fn swap_bytes(self) -> Self {
        self.map(Pixel::swap_bytes)
    }
}

/// The order of bytes within a number of raw image data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// Least significant first.
    Little,
    /// Most significant first.
    Big,
}

impl ByteOrder {
    /// This machine's.
    pub const NATIVE: Self = if cfg!(target_endian = "little") {
        Self::Little
    } else {
        Self::Big
    };
}

/// An image with at least one pixel; row `y` starts at index `y * width`.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    pixels: Vec<T>,
}

impl<T> Image<T> {
    /// Takes pixels row by row; there must be exactly `width * height`.
    pub fn new(width: usize, height: usize, pixels: Vec<T>) -> Result<Self, ImagingError> {
        let count = pixel_count::<T>(width, height)?;
        if pixels.len() != count {
            return Err(ImagingError::PixelCount {
                width,
                height,
                got: pixels.len(),
            });
        }
        Ok(Self { width, height, pixels })
    }

    /// An image whose pixels are computed from column and row.
    ///
    /// # Panics
    /// When the size is empty: a constant size is the caller's own.
    pub fn from_fn(width: usize, height: usize, pixel: impl Fn(usize, usize) -> T) -> Self {
        assert!(pixel_count::<T>(width, height).is_ok(), "image size {width} x {height}");
        let pixels = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| pixel(x, y))
            .collect();
        Self { width, height, pixels }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// All pixels, row by row.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.pixels
    }

    /// Gives the pixels away.
    pub fn into_pixels(self) -> Vec<T> {
        self.pixels
    }

    /// One row; panics outside the image like a slice.
    pub fn row(&self, y: usize) -> &[T] {
        &self.pixels[y * self.width..(y + 1) * self.width]
    }

    /// Rows from top to bottom.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, T> {
        self.pixels.chunks_exact(self.width)
    }

    /// One pixel, none outside the image.
    pub fn get(&self, x: usize, y: usize) -> Option<&T> {
        if x < self.width && y < self.height {
            Some(&self.pixels[y * self.width + x])
        } else {
            None
        }
    }

    /// The same shape with every pixel converted.
    pub fn map<U>(&self, convert: impl Fn(&T) -> U) -> Image<U> {
        Image {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(convert).collect(),
        }
    }

    /// Refuses an image of another size, naming it.
    pub fn require_size_of<U>(&self, other: &Image<U>, what: &str) -> Result<(), ImagingError> {
        if (self.width, self.height) == (other.width, other.height) {
            return Ok(());
        }
        Err(ImagingError::SizeMismatch {
            what: what.to_owned(),
            width: self.width,
            height: self.height,
            expected_width: other.width,
            expected_height: other.height,
        })
    }
}

impl<T: Copy> Image<T> {
    /// An image of one value.
    ///
    /// # Panics
    /// When the size is empty: a constant size is the caller's own.
    pub fn filled(width: usize, height: usize, pixel: T) -> Self {
        Self::from_fn(width, height, |_, _| pixel)
    }

    /// A part of the image.
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Result<Self, ImagingError> {
        let (image_width, image_height) = (self.width, self.height);
        let fits = |start: usize, length: usize, limit| start.checked_add(length).is_some_and(|end| end <= limit);
        if width == 0 || height == 0 || !fits(x, width, image_width) || !fits(y, height, image_height) {
            return Err(ImagingError::CropOutside {
                x,
                y,
                width,
                height,
                image_width,
                image_height,
            });
        }
        let rows = self.rows().skip(y).take(height);
        Ok(Self {
            width,
            height,
            pixels: rows.flat_map(|row| &row[x..x + width]).copied().collect(),
        })
    }

    /// Every pixel repeated `factor` times in both directions; invents no detail, keeps every value.
    pub fn enlarge(&self, factor: usize) -> Result<Self, ImagingError> {
        let (width, height) = (self.width.saturating_mul(factor), self.height.saturating_mul(factor));
        let mut pixels = Vec::with_capacity(pixel_count::<T>(width, height)?);
        for row in self.rows() {
            let start = pixels.len();
            pixels.extend(row.iter().flat_map(|&pixel| std::iter::repeat_n(pixel, factor)));
            for _ in 1..factor {
                pixels.extend_from_within(start..start + width);
            }
        }
        Ok(Self { width, height, pixels })
    }
}

impl<T: Pixel> Image<T> {
    /// From raw rows as image messages carry them: `step` bytes from one row's start to the next, the pixels first,
    /// padding after them.
    pub fn from_bytes(
        width: usize,
        height: usize,
        step: usize,
        order: ByteOrder,
        data: &[u8],
    ) -> Result<Self, ImagingError> {
        let count = pixel_count::<T>(width, height)?;
        let pixel_bytes = size_of::<T>();
        let row_bytes = width * pixel_bytes;
        if step < row_bytes {
            return Err(ImagingError::RowStep {
                step,
                width,
                pixel_bytes,
            });
        }
        let expected = step.saturating_mul(height);
        if data.len() != expected {
            return Err(ImagingError::ByteCount {
                got: data.len(),
                expected,
                height,
                step,
            });
        }
        let mut pixels = vec![T::zeroed(); count];
        for (target, source) in pixels.chunks_exact_mut(width).zip(data.chunks_exact(step)) {
            bytemuck::cast_slice_mut(target).copy_from_slice(&source[..row_bytes]);
        }
        if order != ByteOrder::NATIVE {
            for pixel in &mut pixels {
                *pixel = pixel.swap_bytes();
            }
        }
        Ok(Self { width, height, pixels })
    }

    /// The pixels as bytes in this machine's order, without copying; the step is `width` times the pixel's size.
    pub fn as_bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.pixels)
    }
}

/// An image can be handed over as a message's data without a copy.
impl<T: Pixel> AsRef<[u8]> for Image<T> {
    fn as_ref(&self) -> &[u8] {
        self.as_bytes()
    }
}

fn pixel_count<T>(width: usize, height: usize) -> Result<usize, ImagingError> {
    width
        .checked_mul(height)
        .filter(|&count| {
            count > 0
                && count
                    .checked_mul(size_of::<T>())
                    .is_some_and(|bytes| isize::try_from(bytes).is_ok())
        })
        .ok_or(ImagingError::Size { width, height })
}
