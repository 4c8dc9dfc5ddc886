//! Typed images, masks, exposure stacks and their pictures.
//!
//! Images are plain values: rows from top to bottom, pixels from left to right, nothing between the rows. This crate
//! opens no files and knows no messages; PNG goes in and out as bytes, raw pixels as byte rows with a stated step.
//!
//! ```
//! use imaging::{ExposureStack, Image};
//!
//! let dark = Image::filled(4, 3, 100_u16);
//! let lit = Image::filled(4, 3, 20_000_u16);
//! let stack = ExposureStack::new(&[1, 2, 3], [(0, dark), (1, lit.clone()), (2, lit.clone()), (3, lit)], 65_000)?;
//! assert_eq!(stack.light(2).expect("channel 2").get(3, 2), Some(&20_000));
//!
//! let normals = Image::filled(4, 3, [0.0_f32, 0.0, 1.0]);
//! let png = imaging::encode_png(&imaging::normal_picture(&normals))?;
//! assert_eq!(&png[1..4], b"PNG");
//! # Ok::<(), imaging::ImagingError>(())
//! ```

mod error;
mod exposure_stack;
mod image;
mod linearise;
mod mask;
mod picture;
mod png_codec;

pub use error::ImagingError;
pub use exposure_stack::{DARK_CHANNEL, ExposureStack};
pub use image::{ByteOrder, Image, Pixel};
pub use linearise::gamma_to_linear_mono16;
pub use mask::Mask;
pub use picture::{contact_sheet, gray_picture, gray_to_rgb, normal_picture};
pub use png_codec::{DecodedPng, PngPixel, decode_png, encode_png, write_png};
