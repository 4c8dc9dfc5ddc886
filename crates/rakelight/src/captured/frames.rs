//! Images and what was on when they were taken, joined by their stamps.

use std::collections::BTreeMap;

use anyhow::{Context, ensure};
use imaging::ExposureStack;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::Image as ImageMessage;
use interfaces::{Message, cdr};
use photometric::{PixelRays, View};
use recording::{RawMessage, Topic};

use super::places::Places;
use super::{Captured, Picture};
use crate::image_message::mono16;

/// Raw values from here up are saturated: 12 bits in steps of 16.
const SATURATION: u16 = 65_520;
/// Images of a camera that wait for their exposures; a sequence has eight.
const MOST_WAITING: usize = 32;

pub(super) fn is_wanted(topic: &Topic) -> bool {
    let is = |type_name: &str, suffix: &str| topic.type_name == type_name && topic.name.ends_with(suffix);
    is(ImageMessage::TYPE_NAME, "/image_raw") || is(Exposure::TYPE_NAME, "/exposure")
}

/// All images of a camera's capture.
pub(super) struct Whole {
    pub(super) id: String,
    pub(super) camera: String,
    frames: Vec<(Exposure, ImageMessage)>,
}

/// One camera's messages that belong to no whole capture yet, by stamp.
#[derive(Default)]
struct Waiting {
    exposures: BTreeMap<i64, Exposure>,
    images: BTreeMap<i64, ImageMessage>,
}

#[derive(Default)]
pub(super) struct Collector {
    cameras: BTreeMap<String, Waiting>,
}

impl Collector {
    /// Takes a message; gives the capture that it completes.
    pub(super) fn add(&mut self, message: &RawMessage) -> anyhow::Result<Option<Whole>> {
        let Some((camera, kind)) = message.topic.name.rsplit_once('/') else {
            return Ok(None);
        };
        let waiting = self.cameras.entry(camera.to_owned()).or_default();
        let stamp = if kind == "exposure" {
            let exposure: Exposure = cdr::from_slice(&message.cdr)?;
            let stamp = exposure.header.stamp.to_nanos();
            waiting.exposures.insert(stamp, exposure);
            stamp
        } else {
            let image: ImageMessage = cdr::from_slice(&message.cdr)?;
            let stamp = image.header.stamp.to_nanos();
            waiting.images.insert(stamp, image);
            while waiting.images.len() > MOST_WAITING {
                waiting.images.pop_first();
            }
            stamp
        };
        Ok(waiting.take_whole(camera, stamp))
    }

    /// Captures that never became whole, in words.
    pub(super) fn left_over(self) -> Vec<String> {
        let mut problems = Vec::new();
        for (camera, waiting) in self.cameras {
            let mut arrived: BTreeMap<String, (usize, u8)> = BTreeMap::new();
            for (stamp, exposure) in &waiting.exposures {
                let of_capture = arrived
                    .entry(exposure.capture_id.clone())
                    .or_insert((0, exposure.count));
                of_capture.0 += usize::from(waiting.images.contains_key(stamp));
            }
            for (id, (images, count)) in arrived {
                problems.push(format!(
                    "capture {id}, {camera}: {images} of {count} images are there; not used"
                ));
            }
        }
        problems
    }
}

impl Waiting {
    fn take_whole(&mut self, camera: &str, stamp: i64) -> Option<Whole> {
        let exposure = self.exposures.get(&stamp)?;
        let (id, count) = (exposure.capture_id.clone(), usize::from(exposure.count));
        let own = self.exposures.iter().filter(|(_, exposure)| exposure.capture_id == id);
        let stamps: Vec<i64> = own
            .map(|(stamp, _)| *stamp)
            .filter(|stamp| self.images.contains_key(stamp))
            .collect();
        if stamps.len() < count {
            return None;
        }
        let frames = stamps
            .iter()
            .filter_map(|stamp| Some((self.exposures.remove(stamp)?, self.images.remove(stamp)?)))
            .collect();
        Some(Whole {
            id,
            camera: camera.to_owned(),
            frames,
        })
    }
}

impl Whole {
    pub(super) fn captured(self, places: &Places) -> anyhow::Result<Captured> {
        let first = self.frames.first().context("it has no image")?;
        let header = first.1.header.clone();
        let mut channels: Vec<u8> = self.frames.iter().map(|(exposure, _)| exposure.channel).collect();
        channels.retain(|&channel| channel != imaging::DARK_CHANNEL);
        let images = self
            .frames
            .iter()
            .map(|(exposure, image)| Ok((exposure.channel, mono16(image)?)));
        let images = images.collect::<anyhow::Result<Vec<_>>>()?;
        let stack = ExposureStack::new(&channels, images, SATURATION)?;
        let camera = places.camera(&self.camera)?;
        ensure!(
            (camera.width(), camera.height()) == (stack.width(), stack.height()),
            "images are {} x {}, camera_info says {} x {}",
            stack.width(),
            stack.height(),
            camera.width(),
            camera.height()
        );
        let base_from_camera = places.base_from(&header.frame_id, header.stamp.to_nanos())?;
        Ok(Captured {
            id: self.id,
            camera: self.camera,
            header,
            stack,
            view: View {
                camera,
                base_from_camera,
            },
            rays: PixelRays::new(&camera),
        })
    }
}

impl Whole {
    /// The image under one light, with the lens and where a frame was then, as far as the bag says.
    pub(super) fn picture(self, light: u8, flange: &str, places: &Places) -> anyhow::Result<Picture> {
        let lit = self.frames.iter().find(|(exposure, _)| exposure.channel == light);
        let (_, image) = lit.with_context(|| format!("it has no image under L{light}"))?;
        Ok(Picture {
            frame: image.header.frame_id.clone(),
            image: mono16(image)?,
            lens: places.camera(&self.camera),
            base_from_flange: places.base_from(flange, image.header.stamp.to_nanos()),
            id: self.id,
            camera: self.camera,
        })
    }
}
