//! Between frames, messages and the types that algorithms use.

use std::sync::Arc;
use std::time::Duration;

use camera_aravis::CalibrationFile;
use chrono::DateTime;
use devices::AppliedSettings;
use imaging::{ExposureStack, Image, ImagingError};
use interfaces::ByteSequence;
use interfaces::builtin_interfaces::msg::{Duration as DurationMessage, Time};
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image as ImageMessage};
use interfaces::std_msgs::msg::Header;

use crate::camera::Settled;
use crate::join::JoinedFrame;
use crate::parameters::FULL_SCALE;

/// Pixels that are skipped where a part of the image says enough, in each direction.
const SAMPLE_STEP: usize = 4;

/// Images smaller than this are not thinned out.
const SMALL_SIDE: usize = 256;

/// The three messages of one exposure, with equal headers.
#[derive(Debug, Clone)]
pub(crate) struct ExposureMessages {
    pub(crate) exposure: Arc<Exposure>,
    pub(crate) info: Arc<CameraInfo>,
    pub(crate) image: Arc<ImageMessage>,
}

/// Messages of one camera's share of a capture. The pixels are handed over, not copied.
pub(crate) fn messages(
    capture_id: &str,
    header: &Header,
    settled: &Settled,
    frames: &[JoinedFrame],
) -> Vec<ExposureMessages> {
    let count = frames.len() as u8;
    let message = |(index, joined): (u8, &JoinedFrame)| {
        let header = Header {
            stamp: time(joined.stamp),
            ..header.clone()
        };
        let settings = &settled.applied.settings;
        let exposure = Exposure {
            header: header.clone(),
            capture_id: capture_id.to_owned(),
            channel: joined.channel.number(),
            index,
            count,
            exposure_time: DurationMessage::try_from(settings.exposure).unwrap_or_default(),
            gain_db: settings.gain_db as f32,
        };
        let info = CameraInfo {
            header: header.clone(),
            ..(*settled.info).clone()
        };
        ExposureMessages {
            exposure: Arc::new(exposure),
            info: Arc::new(info),
            image: Arc::new(image(header, joined)),
        }
    };
    (0..).zip(frames).map(message).collect()
}

fn image(header: Header, joined: &JoinedFrame) -> ImageMessage {
    let frame = &joined.frame;
    ImageMessage {
        header,
        height: frame.height,
        width: frame.width,
        encoding: "mono16".into(),
        is_bigendian: 0,
        step: 2 * frame.width,
        data: ByteSequence::from(frame.pixels.clone()),
    }
}

/// What the calibration file says of images with these settings. Without a file the intrinsics are zero, which is how
/// ROS says "not calibrated".
pub(crate) fn camera_info(
    calibration: Option<&CalibrationFile>,
    applied: &AppliedSettings,
    frame_id: String,
) -> Result<CameraInfo, String> {
    let header = Header {
        frame_id,
        ..Header::default()
    };
    let (width, height) = (applied.width, applied.height);
    let Some(file) = calibration else {
        return Ok(CameraInfo {
            header,
            height,
            width,
            ..CameraInfo::default()
        });
    };
    let settings = &applied.settings;
    let scaled = file
        .scaled(settings.binning, settings.region)
        .map_err(|error| error.to_string())?;
    if (scaled.width(), scaled.height()) != (width, height) {
        return Err(format!(
            "its images are {width} x {height} pixels, the calibration file is for {} x {}",
            scaled.width(),
            scaled.height()
        ));
    }
    Ok(CameraInfo {
        header,
        height,
        width,
        distortion_model: scaled.distortion_model().to_owned(),
        d: scaled.distortion_coefficients().to_vec(),
        k: *scaled.camera_matrix(),
        r: *scaled.rectification_matrix(),
        p: *scaled.projection_matrix(),
        ..CameraInfo::default()
    })
}

/// Every fourth pixel of a capture in both directions, for figures about the whole image.
pub(crate) fn sampled_stack(frames: &[JoinedFrame]) -> Result<ExposureStack, ImagingError> {
    let lights: Vec<u8> = (1..=devices::PANEL_COUNT as u8).collect();
    let images = frames.iter().map(|joined| (joined.channel.number(), sampled(joined)));
    ExposureStack::new(&lights, images, FULL_SCALE)
}

fn sampled(joined: &JoinedFrame) -> Image<u16> {
    let frame = &joined.frame;
    let (width, height) = (frame.width as usize, frame.height as usize);
    let step = if width.min(height) < SMALL_SIDE { 1 } else { SAMPLE_STEP };
    Image::from_fn(width.div_ceil(step), height.div_ceil(step), |x, y| {
        let at = 2 * (y * step * width + x * step);
        u16::from_le_bytes([frame.pixels[at], frame.pixels[at + 1]])
    })
}

/// A stamp. From 2038 on the message's 32 bits of seconds are full, whatever is done here.
pub(crate) fn time(nanos: i64) -> Time {
    Time::from_nanos(nanos).unwrap_or(Time {
        sec: i32::MAX,
        nanosec: 0,
    })
}

pub(crate) fn duration(duration: Duration) -> DurationMessage {
    DurationMessage::try_from(duration).unwrap_or_default()
}

/// A name for a capture: sortable by time, unique, short enough to type.
pub(crate) fn capture_id(now: i64) -> String {
    let random = uuid::Uuid::new_v4().as_u128() as u16;
    let date = DateTime::from_timestamp_nanos(now).format("%Y%m%dT%H%M%S%.3fZ");
    format!("{date}-{random:04x}")
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use bytes::Bytes;
    use devices::{Binning, CameraSettings, Channel, Frame, Region, TriggerMode};
    use geometry::PinholeCamera;

    use super::*;

    fn applied(region: Option<Region>, binning: u32, size: [u32; 2]) -> AppliedSettings {
        AppliedSettings {
            settings: CameraSettings {
                region,
                binning: Binning {
                    horizontal: binning,
                    vertical: binning,
                },
                exposure: Duration::from_micros(2500),
                gain_db: 0.0,
                black_level: 0.0,
                trigger: TriggerMode::Line,
            },
            width: size[0],
            height: size[1],
        }
    }

    fn file() -> CalibrationFile {
        let camera = PinholeCamera::new(1536, 1536, [2181.8, 2181.8], [767.5, 767.5]).unwrap();
        CalibrationFile::new("c1", &camera)
    }

    #[test]
    fn camera_info_is_that_of_the_images() {
        let region = Region {
            x: 192,
            y: 96,
            width: 384,
            height: 256,
        };
        let info = camera_info(
            Some(&file()),
            &applied(Some(region), 2, [384, 256]),
            "c1_optical_frame".into(),
        )
        .unwrap();
        assert_eq!(
            (info.width, info.height, info.header.frame_id.as_str()),
            (384, 256, "c1_optical_frame")
        );
        assert!((info.k[0] - 1090.9).abs() < 1e-9, "{:?}", info.k);
        assert!((info.k[2] - (383.5 - 192.0)).abs() < 1e-9, "{:?}", info.k);
        assert!((info.p[6] - (383.5 - 96.0)).abs() < 1e-9, "{:?}", info.p);
    }

    #[test]
    fn a_calibration_of_another_sensor_is_refused() {
        let problem = camera_info(Some(&file()), &applied(None, 1, [640, 480]), String::new()).unwrap_err();
        assert_eq!(
            problem,
            "its images are 640 x 480 pixels, the calibration file is for 1536 x 1536"
        );
        let info = camera_info(None, &applied(None, 1, [640, 480]), String::new()).unwrap();
        assert_eq!((info.width, info.k), (640, [0.0; 9]), "not calibrated");
    }

    #[test]
    fn capture_ids_sort_by_time_and_differ() {
        let at = 1_700_000_000_123_456_789;
        let id = capture_id(at);
        assert!(id.starts_with("20231114T221320.123Z-") && id.len() == 25, "{id}");
        assert!(id < capture_id(at + 1_000_000));
    }

    #[test]
    fn large_images_are_thinned_out_and_small_ones_are_not() {
        let frame = |channel: u8, side: u32| {
            let pixels: Vec<u8> = (0..side * side)
                .flat_map(|pixel| (pixel as u16).to_le_bytes())
                .collect();
            JoinedFrame {
                channel: Channel::new(channel).unwrap(),
                stamp: 0,
                frame: Frame {
                    index: 0,
                    exposed_at: Duration::ZERO,
                    received_at: Instant::now(),
                    width: side,
                    height: side,
                    pixels: Bytes::from(pixels),
                },
            }
        };
        let stack = |side| sampled_stack(&(0..8).map(|channel| frame(channel, side)).collect::<Vec<_>>()).unwrap();
        assert_eq!(stack(256).dark().get(2, 1), Some(&(4 * 256 + 8)));
        assert_eq!((stack(64).width(), stack(64).dark().get(2, 1)), (64, Some(&66)));
    }
}
