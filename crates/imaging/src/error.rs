//! What can be wrong with images.

/// Why an image operation was refused, with what was given and what is allowed.
#[derive(Debug, thiserror::Error)]
pub enum ImagingError {
    /// The pixels do not fill the image.
    #[error("an image of {width} x {height} needs {} pixels, got {got}", width * height)]
    PixelCount {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels given.
        got: usize,
    },
    /// Width times height is not representable, or one of them is zero.
    #[error("image size {width} x {height} is empty or too large")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A row of the raw data is shorter than its pixels.
    #[error("row step of {step} bytes is shorter than {width} pixels of {pixel_bytes} bytes")]
    RowStep {
        /// Distance between row starts, bytes.
        step: usize,
        /// Columns.
        width: usize,
        /// Size of one pixel.
        pixel_bytes: usize,
    },
    /// Raw data does not hold `height` rows of `step` bytes.
    #[error("raw image data has {got} bytes, {height} rows of {step} bytes are {expected}")]
    ByteCount {
        /// Bytes given.
        got: usize,
        /// Bytes needed.
        expected: usize,
        /// Rows.
        height: usize,
        /// Distance between row starts, bytes.
        step: usize,
    },
    /// A crop must lie inside the image.
    #[error("crop of {width} x {height} at ({x}, {y}) leaves the image of {image_width} x {image_height}")]
    CropOutside {
        /// First column.
        x: usize,
        /// First row.
        y: usize,
        /// Columns wanted.
        width: usize,
        /// Rows wanted.
        height: usize,
        /// Columns there are.
        image_width: usize,
        /// Rows there are.
        image_height: usize,
    },
    /// Two things that belong together differ in size.
    #[error("{what} is {width} x {height}, expected {expected_width} x {expected_height}")]
    SizeMismatch {
        /// The odd one out.
        what: String,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
        /// Columns of the others.
        expected_width: usize,
        /// Rows of the others.
        expected_height: usize,
    },
    /// An exposure stack holds each channel once.
    #[error("light channel {channel} was given twice (0 is the dark frame)")]
    DuplicateChannel {
        /// The channel.
        channel: u8,
    },
    /// An exposure stack needs the dark frame and every expected light.
    #[error("light channels {missing:?} are missing (0 is the dark frame); present are {present:?}")]
    MissingChannels {
        /// Expected and not given.
        missing: Vec<u8>,
        /// Given.
        present: Vec<u8>,
    },
    /// An image of a light nobody expects.
    #[error("light channel {channel} is not among the expected {expected:?}")]
    UnexpectedChannel {
        /// The channel.
        channel: u8,
        /// The lights expected.
        expected: Vec<u8>,
    },
    /// A number is outside what makes sense.
    #[error("{what} = {value} is outside {allowed}")]
    OutOfRange {
        /// The parameter.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// A PNG of a kind this crate does not read.
    #[error("PNG is {found}; readable are 8 and 16 bit gray and 8 bit RGB")]
    PngKind {
        /// Colour type and depth found.
        found: String,
    },
    /// Damaged or truncated PNG data.
    #[error("PNG cannot be read: {0}")]
    PngDecode(#[from] png::DecodingError),
    /// The writer failed, or the image is larger than PNG allows.
    #[error("PNG cannot be written: {0}")]
    PngEncode(#[from] png::EncodingError),
}
