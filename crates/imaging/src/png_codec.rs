//! PNG to and from bytes.

use std::io::{Cursor, Write};

use png::{BitDepth, ColorType};

use crate::error::ImagingError;
use crate::image::{ByteOrder, Image, Pixel};

/// Larger pictures are refused before they are unpacked: 16384 x 16384 at 16 bit.
const MAX_DECODED_BYTES: usize = 1 << 29;

/// Pixels PNG can hold.
pub trait PngPixel: Pixel {
    /// How PNG calls them.
    const COLOR_TYPE: ColorType;
    /// Bits of each number.
    const BIT_DEPTH: BitDepth;
}

impl PngPixel for u8 {
    const COLOR_TYPE: ColorType = ColorType::Grayscale;
    const BIT_DEPTH: BitDepth = BitDepth::Eight;
}

impl PngPixel for u16 {
    const COLOR_TYPE: ColorType = ColorType::Grayscale;
    const BIT_DEPTH: BitDepth = BitDepth::Sixteen;
}

impl PngPixel for [u8; 3] {
    const COLOR_TYPE: ColorType = ColorType::Rgb;
    const BIT_DEPTH: BitDepth = BitDepth::Eight;
}

/// What a PNG turned out to be.
#[derive(Debug, Clone, PartialEq)]
pub enum DecodedPng {
    /// 8-bit gray.
    Gray8(Image<u8>),
    /// 16-bit gray.
    Gray16(Image<u16>),
    /// 8-bit colour.
    Rgb8(Image<[u8; 3]>),
}

/// Reads an 8- or 16-bit gray or 8-bit RGB picture; other kinds, damaged and oversized ones are refused.
pub fn decode_png(bytes: &[u8]) -> Result<DecodedPng, ImagingError> {
    let limits = png::Limits {
        bytes: MAX_DECODED_BYTES,
    };
    let mut reader = png::Decoder::new_with_limits(Cursor::new(bytes), limits).read_info()?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let size = reader.output_buffer_size().filter(|&size| size <= MAX_DECODED_BYTES);
    let mut data = vec![0; size.ok_or(ImagingError::Size { width, height })?];
    let frame = reader.next_frame(&mut data)?;
    let (step, data) = (frame.line_size, &data[..frame.buffer_size()]);
    Ok(match (frame.color_type, frame.bit_depth) {
        (ColorType::Grayscale, BitDepth::Eight) => DecodedPng::Gray8(big_endian(width, height, step, data)?),
        (ColorType::Grayscale, BitDepth::Sixteen) => DecodedPng::Gray16(big_endian(width, height, step, data)?),
        (ColorType::Rgb, BitDepth::Eight) => DecodedPng::Rgb8(big_endian(width, height, step, data)?),
        (color, depth) => {
            return Err(ImagingError::PngKind {
                found: format!("{color:?} of {} bit", depth as u8),
            });
        }
    })
}

fn big_endian<T: Pixel>(width: usize, height: usize, step: usize, data: &[u8]) -> Result<Image<T>, ImagingError> {
    Image::from_bytes(width, height, step, ByteOrder::Big, data)
}

/// Writes a picture; `writer` is not flushed.
pub fn write_png<T: PngPixel>(image: &Image<T>, writer: impl Write) -> Result<(), ImagingError> {
    let too_large = |_| ImagingError::Size {
        width: image.width(),
        height: image.height(),
    };
    let width = u32::try_from(image.width()).map_err(too_large)?;
    let height = u32::try_from(image.height()).map_err(too_large)?;
    let mut encoder = png::Encoder::new(writer, width, height);
    encoder.set_color(T::COLOR_TYPE);
    encoder.set_depth(T::BIT_DEPTH);
    encoder.set_compression(png::Compression::Fast);
    let mut output = encoder.write_header()?;
    if ByteOrder::NATIVE == ByteOrder::Big || size_of::<T>() != 2 {
        output.write_image_data(image.as_bytes())?;
    } else {
        output.write_image_data(image.map(|&pixel| pixel.swap_bytes()).as_bytes())?;
    }
    Ok(output.finish()?)
}

/// A picture as PNG bytes.
pub fn encode_png<T: PngPixel>(image: &Image<T>) -> Result<Vec<u8>, ImagingError> {
    let mut bytes = Vec::new();
    write_png(image, &mut bytes)?;
    Ok(bytes)
}
