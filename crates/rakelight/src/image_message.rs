//! Images out of messages.

use anyhow::ensure;
use imaging::{ByteOrder, Image, Pixel};
use interfaces::sensor_msgs::msg::Image as ImageMessage;

/// A camera's image.
pub(crate) fn mono16(message: &ImageMessage) -> anyhow::Result<Image<u16>> {
    encoded(message, "an image", "mono16")
}

/// Unit vectors in the base frame; NaN where there is none.
pub(crate) fn normal_map(message: &ImageMessage) -> anyhow::Result<Image<[f32; 3]>> {
    encoded(message, "a normal map", "32FC3")
}

/// The message's bytes, whatever it says of its encoding.
pub(crate) fn pixels<T: Pixel>(message: &ImageMessage) -> anyhow::Result<Image<T>> {
    let order = if message.is_bigendian == 0 {
        ByteOrder::Little
    } else {
        ByteOrder::Big
    };
    let (width, height) = (message.width as usize, message.height as usize);
    Ok(Image::from_bytes(
        width,
        height,
        message.step as usize,
        order,
        &message.data,
    )?)
}

fn encoded<T: Pixel>(message: &ImageMessage, what: &str, encoding: &str) -> anyhow::Result<Image<T>> {
    ensure!(
        message.encoding == encoding,
        "{what} is encoded as {:?}; expected {encoding}",
        message.encoding
    );
    pixels(message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_encoding_is_refused_and_both_byte_orders_are_read() {
        let mut message = ImageMessage {
            width: 1,
            height: 1,
            step: 2,
            encoding: "mono16".into(),
            data: vec![1, 2].into(),
            ..ImageMessage::default()
        };
        assert_eq!(mono16(&message).unwrap().pixels(), [0x0201]);
        message.is_bigendian = 1;
        assert_eq!(mono16(&message).unwrap().pixels(), [0x0102]);
        let error = normal_map(&message).unwrap_err().to_string();
        assert_eq!(error, "a normal map is encoded as \"mono16\"; expected 32FC3");
    }
}
