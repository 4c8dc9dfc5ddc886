//! Maps out of messages.

use imaging::{ByteOrder, Image, Pixel};
use interfaces::sensor_msgs::msg::Image as ImageMessage;

pub(super) fn normal_map(message: &ImageMessage) -> anyhow::Result<Image<[f32; 3]>> {
    anyhow::ensure!(
        message.encoding == "32FC3",
        "a normal map is encoded as {:?}; expected 32FC3",
        message.encoding
    );
    pixels(message)
}

pub(super) fn pixels<T: Pixel>(message: &ImageMessage) -> anyhow::Result<Image<T>> {
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
