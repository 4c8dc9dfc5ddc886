//! Images and normal maps whose every pixel is known, so that the receiver can check all of them.

use interfaces::ByteSequence;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use interfaces::std_msgs::msg::Header;

const FRAME: &str = "c1_optical_frame";

/// A square `mono16` image of `size` pixels a side: pixel (row, column) is `row * size + column + offset`, modulo 2^16.
pub fn image(size: u32, offset: u16, stamp: Time) -> Image {
    let pixel = |index: u32| (index as u16).wrapping_add(offset).to_le_bytes();
    let data: Vec<u8> = (0..size * size).flat_map(pixel).collect();
    square(size, "mono16", 2, data.into(), stamp)
}

/// Whether `image` is [`image`] of its own size, whatever its offset.
pub fn is_image(image: &Image) -> bool {
    let Some(first) = image.data.first_chunk() else {
        return false;
    };
    let expected = self::image(image.width, u16::from_le_bytes(*first), image.header.stamp);
    *image == expected
}

/// A square `32FC3` normal map of `size` pixels a side: the hemisphere that fills it.
///
/// With x = (2 column + 1) / size - 1 and y = (2 row + 1) / size - 1 the normal is (x, y, sqrt(1 - x^2 - y^2)), and NaN
/// where that is not real.
pub fn normal_map(size: u32, stamp: Time) -> Image {
    let coordinate = |index: u32| (2 * index + 1) as f32 / size as f32 - 1.0;
    let mut data = Vec::with_capacity(size as usize * size as usize * 12);
    for row in 0..size {
        for column in 0..size {
            let (x, y) = (coordinate(column), coordinate(row));
            let z = (1.0 - x * x - y * y).sqrt();
            let normal = if z.is_nan() { [f32::NAN; 3] } else { [x, y, z] };
            data.extend(normal.iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    square(size, "32FC3", 12, data.into(), stamp)
}

/// Calibration of the camera that "took" them.
pub fn camera_info(size: u32, stamp: Time) -> CameraInfo {
    let (focal_px, centre_px) = (f64::from(size) * 1.42, f64::from(size) / 2.0);
    CameraInfo {
        header: header(stamp),
        height: size,
        width: size,
        distortion_model: "plumb_bob".into(),
        d: vec![0.0; 5],
        k: [focal_px, 0.0, centre_px, 0.0, focal_px, centre_px, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [
            focal_px, 0.0, centre_px, 0.0, 0.0, focal_px, centre_px, 0.0, 0.0, 0.0, 1.0, 0.0,
        ],
        ..CameraInfo::default()
    }
}

fn square(size: u32, encoding: &str, bytes_per_pixel: u32, data: ByteSequence, stamp: Time) -> Image {
    Image {
        header: header(stamp),
        height: size,
        width: size,
        encoding: encoding.into(),
        is_bigendian: 0,
        step: size * bytes_per_pixel,
        data,
    }
}

fn header(stamp: Time) -> Header {
    Header {
        stamp,
        frame_id: FRAME.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_pixel_is_noticed() {
        let good = image(16, 65_500, Time::default());
        assert!(is_image(&good));
        let mut bytes = good.data.to_vec();
        bytes[100] ^= 1;
        assert!(!is_image(&Image {
            data: bytes.into(),
            ..good
        }));
    }

    #[test]
    fn a_normal_map_is_a_hemisphere() {
        let map = normal_map(2, Time::default());
        let normal: Vec<f32> = map
            .data
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert_eq!(normal[..2], [-0.5, -0.5]);
        assert!((normal[2] - 0.5_f32.sqrt()).abs() < 1e-6);
        assert!(
            normal_map(16, Time::default()).data[..4] == f32::NAN.to_le_bytes(),
            "corners are not measured"
        );
    }
}
