//! Between messages and the types that algorithms use.

use geometry::nalgebra::Vector3;
use geometry::{PinholeCamera, RigidTransform};
use grasp::Overlay;
use imaging::{ByteOrder, Image, ImagingError, Pixel, encode_png};
use interfaces::geometry_msgs::msg::{Point, Pose, Quaternion, Vector3 as Vector3Message};
use interfaces::sensor_msgs::msg::{CameraInfo, CompressedImage, Image as ImageMessage};
use interfaces::std_msgs::msg::Header;

use crate::error::ViewError;

/// Pixels as maps carry them.
pub(crate) trait MapPixel: Pixel {
    const ENCODING: &'static str;
}

impl MapPixel for u8 {
    const ENCODING: &'static str = "mono8";
}

impl MapPixel for f32 {
    const ENCODING: &'static str = "32FC1";
}

impl MapPixel for [f32; 3] {
    const ENCODING: &'static str = "32FC3";
}

/// A map; `name` is for the error.
pub(crate) fn image<T: MapPixel>(name: &'static str, message: &ImageMessage) -> Result<Image<T>, ViewError> {
    if message.encoding != T::ENCODING {
        return Err(ViewError::Encoding {
            map: name,
            found: message.encoding.clone(),
            allowed: T::ENCODING,
        });
    }
    let order = if message.is_bigendian == 0 {
        ByteOrder::Little
    } else {
        ByteOrder::Big
    };
    let (width, height, step) = (message.width as usize, message.height as usize, message.step as usize);
    Image::from_bytes(width, height, step, order, &message.data)
        .map_err(|problem| ViewError::Pixels { map: name, problem })
}

pub(crate) fn lens(info: &CameraInfo) -> Result<PinholeCamera, ViewError> {
    let (width, height) = (info.width as usize, info.height as usize);
    Ok(PinholeCamera::from_camera_info(
        width,
        height,
        &info.k,
        &info.distortion_model,
        &info.d,
    )?)
}

pub(crate) fn pose(pose: &RigidTransform) -> Pose {
    let [x, y, z, w] = pose.quaternion_xyzw();
    Pose {
        position: point(&pose.translation()),
        orientation: Quaternion { x, y, z, w },
    }
}

pub(crate) fn point(at: &Vector3<f64>) -> Point {
    Point {
        x: at.x,
        y: at.y,
        z: at.z,
    }
}

pub(crate) fn vector(vector: &Vector3<f64>) -> Vector3Message {
    Vector3Message {
        x: vector.x,
        y: vector.y,
        z: vector.z,
    }
}

/// For people and browsers.
pub(crate) fn preview(header: Header, overlay: &Overlay) -> Result<CompressedImage, ImagingError> {
    Ok(CompressedImage {
        header,
        format: "rgb8; png compressed rgb8".into(),
        data: encode_png(overlay.picture())?.into(),
    })
}

#[cfg(test)]
mod tests {
    use interfaces::ByteSequence;

    use super::*;

    fn message(encoding: &str, data: Vec<u8>) -> ImageMessage {
        ImageMessage {
            width: 2,
            height: 1,
            encoding: encoding.into(),
            step: data.len() as u32,
            data: ByteSequence::from(data),
            ..ImageMessage::default()
        }
    }

    #[test]
    fn maps_are_read_in_either_byte_order() {
        let bytes: Vec<u8> = [1.5_f32, -2.0].into_iter().flat_map(f32::to_le_bytes).collect();
        let map: Image<f32> = image("depth", &message("32FC1", bytes)).expect("a map");
        assert_eq!(map.pixels(), [1.5, -2.0]);
        let bytes: Vec<u8> = [1.5_f32, -2.0].into_iter().flat_map(f32::to_be_bytes).collect();
        let big = ImageMessage {
            is_bigendian: 1,
            ..message("32FC1", bytes)
        };
        assert_eq!(image::<f32>("depth", &big).expect("a map").pixels(), [1.5, -2.0]);
    }

    #[test]
    fn a_map_that_is_none_is_named() {
        let error = image::<[f32; 3]>("normals", &message("rgb8", vec![0; 6])).expect_err("no normals");
        assert_eq!(error.to_string(), "normals is encoded as \"rgb8\"; allowed: 32FC3");
        let error = image::<f32>("depth", &message("32FC1", vec![0; 7])).expect_err("seven bytes");
        assert!(error.to_string().starts_with("depth: "), "{error}");
    }

    #[test]
    fn a_pose_keeps_its_numbers() {
        let transform = RigidTransform::from_quaternion_xyzw([0.1, -0.2, 0.3], [1.0, 0.0, 0.0, 0.0]).expect("a pose");
        let message = pose(&transform);
        assert_eq!(
            (message.position.x, message.position.y, message.position.z),
            (0.1, -0.2, 0.3)
        );
        assert_eq!((message.orientation.x, message.orientation.w), (1.0, 0.0));
    }
}
