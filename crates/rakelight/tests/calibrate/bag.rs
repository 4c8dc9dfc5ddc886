//! Bags as the cell records them, of a rendered target.

use std::path::Path;

use camera_calibration::CharucoTarget;
use geometry::{PinholeCamera, RigidTransform};
use interfaces::geometry_msgs::msg::{Quaternion, Transform, TransformStamped, Vector3};
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use interfaces::std_msgs::msg::Header;
use interfaces::tf2_msgs::msg::TFMessage;
use interfaces::{Message, builtin_interfaces::msg::Time, cdr};
use recording::{BagWriter, OfferedQos};

use crate::rendering::Picture;

const START: i64 = 1_700_000_000_000_000_000;

/// A camera's capture under L7 with the arm at a place.
pub(crate) struct Stand {
    pub(crate) base_from_flange: RigidTransform,
    pub(crate) camera_from_target: RigidTransform,
}

/// Writes one capture of `c1` for every stand. Cameras that are not calibrated send zeros.
pub(crate) fn write(folder: &Path, target: &CharucoTarget, camera: &PinholeCamera, stands: &[Stand]) {
    let mut bag = Writer {
        bag: BagWriter::create(folder).unwrap(),
        stamp: START,
    };
    for (index, stand) in stands.iter().enumerate() {
        bag.stamp += 1_000_000_000;
        let picture = Picture {
            seed: index as u64,
            ..Picture::USUAL
        };
        let image = picture.take(target, camera, &stand.camera_from_target);
        let header = bag.header("c1_optical_frame");
        let (width, height) = (image.width() as u32, image.height() as u32);
        let bytes: Vec<u8> = image.pixels().iter().flat_map(|value| value.to_le_bytes()).collect();
        bag.write("/tf", &arm(&stand.base_from_flange, bag.header("link_base")));
        bag.write(
            "/cell/c1/camera_info",
            &CameraInfo {
                header: header.clone(),
                width,
                height,
                ..CameraInfo::default()
            },
        );
        bag.write(
            "/cell/c1/exposure",
            &Exposure {
                header: header.clone(),
                capture_id: format!("stand-{index}"),
                channel: 7,
                count: 1,
                ..Exposure::default()
            },
        );
        bag.write(
            "/cell/c1/image_raw",
            &Image {
                header,
                width,
                height,
                encoding: "mono16".into(),
                step: 2 * width,
                data: bytes.into(),
                ..Image::default()
            },
        );
    }
    bag.bag.finish().unwrap();
}

struct Writer {
    bag: BagWriter,
    stamp: i64,
}

impl Writer {
    fn header(&self, frame: &str) -> Header {
        Header {
            stamp: Time::from_nanos(self.stamp).unwrap(),
            frame_id: frame.into(),
        }
    }

    fn write<M: Message>(&mut self, topic: &str, message: &M) {
        let options = OfferedQos::default().into();
        let topic = self
            .bag
            .add_topic(topic, M::TYPE_NAME, M::DEFINITION, &options)
            .unwrap();
        let bytes = cdr::to_vec(message).unwrap();
        self.bag.write(topic, self.stamp as u64, &bytes).unwrap();
    }
}

fn arm(base_from_flange: &RigidTransform, header: Header) -> TFMessage {
    let [x, y, z] = base_from_flange.translation().into();
    let [qx, qy, qz, qw] = base_from_flange.quaternion_xyzw();
    TFMessage {
        transforms: vec![TransformStamped {
            header,
            child_frame_id: "link_eef".into(),
            transform: Transform {
                translation: Vector3 { x, y, z },
                rotation: Quaternion {
                    x: qx,
                    y: qy,
                    z: qz,
                    w: qw,
                },
            },
        }],
    }
}
