//! Between messages and the types that algorithms use.

use imaging::{ByteOrder, ExposureStack, Image, encode_png, normal_picture};
use interfaces::ByteSequence;
use interfaces::sensor_msgs::msg::{CompressedImage, Image as ImageMessage};
use interfaces::std_msgs::msg::Header;
use photometric::DirectionalLight;

use crate::assembler::{Capture, Frame};
use crate::error::Error;

/// The images of a capture as a checked stack for these lights.
pub(crate) fn exposure_stack(
    capture: &Capture,
    lights: &[DirectionalLight],
    saturation: u16,
) -> Result<ExposureStack, Error> {
    let channels: Vec<u8> = lights.iter().map(DirectionalLight::channel).collect();
    stack_of_channels(capture, &channels, saturation)
}

/// The images of a capture as a checked stack of exactly these lights.
pub(crate) fn stack_of_channels(capture: &Capture, channels: &[u8], saturation: u16) -> Result<ExposureStack, Error> {
    let images = capture.frames.iter().map(brightness).collect::<Result<Vec<_>, _>>()?;
    Ok(ExposureStack::new(channels, images, saturation)?)
}

/// Channel and linear brightness of a frame.
fn brightness(frame: &Frame) -> Result<(u8, Image<u16>), Error> {
    let (exposure, image) = (&frame.exposure, &frame.image);
    if image.encoding != "mono16" {
        return Err(Error::Encoding {
            index: exposure.index,
            found: image.encoding.clone(),
        });
    }
    let order = if image.is_bigendian == 0 {
        ByteOrder::Little
    } else {
        ByteOrder::Big
    };
    let (width, height) = (image.width as usize, image.height as usize);
    let pixels = Image::from_bytes(width, height, image.step as usize, order, &image.data)?;
    Ok((exposure.channel, pixels))
}

/// A normal map as a message. The pixels are handed over, not copied.
pub(crate) fn normal_message(header: Header, normals: Image<[f32; 3]>) -> ImageMessage {
    let (width, height) = (normals.width() as u32, normals.height() as u32);
    ImageMessage {
        header,
        height,
        width,
        encoding: "32FC3".into(),
        is_bigendian: u8::from(cfg!(target_endian = "big")),
        step: width * 12,
        data: ByteSequence::from_owner(normals),
    }
}

/// A gray picture, for people and browsers.
pub(crate) fn gray_preview(header: Header, picture: &Image<u8>) -> Result<CompressedImage, Error> {
    Ok(CompressedImage {
        header,
        format: "mono8; png compressed mono8".into(),
        data: encode_png(picture)?.into(),
    })
}

/// The normal map in colours, for people and browsers.
pub(crate) fn preview(header: Header, normals: &Image<[f32; 3]>) -> Result<CompressedImage, Error> {
    let png = encode_png(&normal_picture(normals))?;
    Ok(CompressedImage {
        header,
        format: "rgb8; png compressed rgb8".into(),
        data: png.into(),
    })
}
