//! Six photographs of a white football under six oblique lights (Quéau et al., CVPR 2017), as a capture of the cell.
//!
//! The photographs are 8-bit with a gamma of about 2.2; the light directions are rough, in the camera's optical frame.

use std::fs;
use std::path::Path;

use anyhow::{Context, ensure};
use imaging::{DecodedPng, ExposureStack, Image, Mask, decode_png, gamma_to_linear_mono16};
use interfaces::builtin_interfaces::msg::Time;
use interfaces::geometry_msgs::msg::{Quaternion, Transform, TransformStamped, Vector3};
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::Image as ImageMessage;
use interfaces::std_msgs::msg::Header;
use interfaces::tf2_msgs::msg::TFMessage;
use interfaces::{ByteSequence, Message, cdr};
use recording::{BagWriter, OfferedQos, TopicId};
use serde::Deserialize;

/// Frame of the photographs and of their light directions.
pub(crate) const CAMERA_FRAME: &str = "c1_optical_frame";

/// Lights of the photographs.
pub(crate) const LIGHTS: usize = 6;

const GAMMA: f64 = 2.2;
/// Any time will do; the photographs carry none.
const FIRST_STAMP_S: i32 = 1_700_000_000;
const STEP_NS: u32 = 50_000_000;

/// The photographs, linear, and what is known of them.
pub(crate) struct Football {
    /// The dark frame, then one image per light.
    images: Vec<Image<u16>>,
    /// From the surface towards each light; optical frame.
    pub(crate) light_directions_in_camera: Vec<[f64; 3]>,
    /// The ball.
    pub(crate) mask: Mask,
    /// Of the camera, pixels.
    pub(crate) focal: [f64; 2],
}

#[derive(Deserialize)]
struct Calibration {
    #[serde(rename = "S")]
    light_directions: Vec<[f64; 3]>,
    #[serde(rename = "K")]
    intrinsics: [[f64; 3]; 3],
}

impl Football {
    pub(crate) fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join("calib.json");
        let text = fs::read_to_string(&path).with_context(|| format!("no football at {}", path.display()))?;
        let calibration: Calibration =
            serde_json::from_str(&text).with_context(|| format!("cannot read {}", path.display()))?;
        let lights = calibration.light_directions.len();
        ensure!(
            lights == LIGHTS,
            "{}: S has {lights} directions; expected {LIGHTS}",
            path.display()
        );
        let names = std::iter::once("ambient".to_owned()).chain((1..=LIGHTS).map(|light| format!("I{light}")));
        let images = names
            .map(|name| photograph(&folder.join(format!("{name}.png"))))
            .collect::<anyhow::Result<_>>()?;
        let path = folder.join("mask.png");
        let DecodedPng::Gray8(mask) = read_png(&path)? else {
            anyhow::bail!("{}: expected 8-bit grey", path.display());
        };
        let mask = Mask::from_nonzero(&mask);
        Ok(Self {
            images,
            light_directions_in_camera: calibration.light_directions,
            mask,
            focal: [calibration.intrinsics[0][0], calibration.intrinsics[1][1]],
        })
    }

    /// The lengths of the directions: they fit the photographs better than equal lights do.
    pub(crate) fn light_intensities(&self) -> Vec<f64> {
        self.light_directions_in_camera
            .iter()
            .map(|s| s.iter().map(|x| x * x).sum::<f64>().sqrt())
            .collect()
    }

    /// The photographs as a stack, the one without light as its dark frame.
    pub(crate) fn stack(&self) -> anyhow::Result<ExposureStack> {
        let channels: Vec<u8> = (1..=LIGHTS as u8).collect();
        Ok(ExposureStack::new(
            &channels,
            (0_u8..).zip(self.images.clone()),
            u16::MAX,
        )?)
    }

    /// Writes them in the layout of the cell's recordings; replaces what an earlier run wrote.
    pub(crate) fn write_bag(&self, folder: &Path) -> anyhow::Result<()> {
        if folder.exists() {
            fs::remove_dir_all(folder).with_context(|| format!("cannot replace {}", folder.display()))?;
        }
        let mut bag = BagWriter::create(folder)?;
        let tf = add::<TFMessage>(&mut bag, "/tf")?;
        let images = add::<ImageMessage>(&mut bag, "/cell/c1/image_raw")?;
        let exposures = add::<Exposure>(&mut bag, "/cell/c1/exposure")?;
        for (index, image) in (0_u8..).zip(&self.images) {
            let stamp = Time {
                sec: FIRST_STAMP_S,
                nanosec: u32::from(index) * STEP_NS,
            };
            let header = Header {
                stamp,
                frame_id: CAMERA_FRAME.into(),
            };
            put(&mut bag, tf, stamp, &camera_pose(stamp))?;
            put(
                &mut bag,
                exposures,
                stamp,
                &exposure(header.clone(), index, self.images.len()),
            )?;
            put(&mut bag, images, stamp, &message(header, image))?;
        }
        Ok(bag.finish()?)
    }
}

/// A photograph, linear.
fn photograph(path: &Path) -> anyhow::Result<Image<u16>> {
    let DecodedPng::Rgb8(picture) = read_png(path)? else {
        anyhow::bail!("{}: expected 8-bit RGB", path.display());
    };
    Ok(gamma_to_linear_mono16(&picture, GAMMA)?)
}

fn read_png(path: &Path) -> anyhow::Result<DecodedPng> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    decode_png(&bytes).with_context(|| format!("cannot decode {}", path.display()))
}

fn add<M: Message>(bag: &mut BagWriter, topic: &str) -> anyhow::Result<TopicId> {
    Ok(bag.add_topic(topic, M::TYPE_NAME, M::DEFINITION, &OfferedQos::default().into())?)
}

fn put<M: Message>(bag: &mut BagWriter, topic: TopicId, stamp: Time, message: &M) -> anyhow::Result<()> {
    let nanos = u64::try_from(stamp.sec)? * 1_000_000_000 + u64::from(stamp.nanosec);
    Ok(bag.write(topic, nanos, &cdr::to_vec(message)?)?)
}

fn exposure(header: Header, index: u8, count: usize) -> Exposure {
    let count = u8::try_from(count).expect("a handful of photographs");
    // The dark frame comes first, so that a light's number is its place.
    Exposure {
        header,
        capture_id: "white_football".into(),
        channel: index,
        index,
        count,
        ..Exposure::default()
    }
}

fn message(header: Header, image: &Image<u16>) -> ImageMessage {
    let (width, height) = (image.width() as u32, image.height() as u32);
    let data = ByteSequence::from(image.as_bytes());
    ImageMessage {
        header,
        height,
        width,
        encoding: "mono16".into(),
        is_bigendian: 0,
        step: 2 * width,
        data,
    }
}

/// The camera hangs over the table and looks straight down, its x axis along the base's: what faces it faces up.
fn camera_pose(stamp: Time) -> TFMessage {
    let header = Header {
        stamp,
        frame_id: "link_base".into(),
    };
    let translation = Vector3 {
        x: 0.43,
        y: 0.0,
        z: 0.5,
    };
    let half_turn_about_x = Quaternion {
        x: 1.0,
        y: 0.0,
        z: 0.0,
        w: 0.0,
    };
    let transform = Transform {
        translation,
        rotation: half_turn_about_x,
    };
    TFMessage {
        transforms: vec![TransformStamped {
            header,
            child_frame_id: CAMERA_FRAME.into(),
            transform,
        }],
    }
}
