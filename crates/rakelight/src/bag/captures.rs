//! The captures of a bag, found by what the exposures say.

use std::collections::{BTreeMap, BTreeSet};

use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::Image;
use interfaces::{Message, cdr};
use recording::{Bag, RawMessage, RecordingError};
use serde::Serialize;

use super::message::header_stamp;

/// The images of a bag, and the captures they make.
#[derive(Debug, Default)]
pub(crate) struct Captures {
    /// In the order of their first exposure.
    pub(crate) captures: Vec<Capture>,
    /// By camera (the topics' common beginning).
    pub(crate) cameras: BTreeMap<String, Camera>,
}

/// One light sequence.
#[derive(Debug, Serialize)]
pub(crate) struct Capture {
    /// Position in the bag, from 1.
    pub(crate) number: usize,
    pub(crate) id: String,
    /// Stamp of its first image, nanoseconds.
    pub(crate) stamp: i64,
    pub(crate) cameras: Vec<CameraCapture>,
    /// Log times of its first and last message.
    #[serde(skip)]
    pub(crate) span: (u64, u64),
}

/// What one camera saw of a capture.
#[derive(Debug, Serialize)]
pub(crate) struct CameraCapture {
    pub(crate) camera: String,
    /// Images that the sequence has.
    pub(crate) count: u8,
    pub(crate) exposures: Vec<ExposureReport>,
}

/// One exposure.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ExposureReport {
    pub(crate) index: u8,
    /// `dark`, `L1`, ...
    pub(crate) light: String,
    pub(crate) stamp: i64,
    /// Whether an image of the same stamp is there.
    pub(crate) has_image: bool,
}

/// The image stamps of one camera.
#[derive(Debug, Default)]
pub(crate) struct Camera {
    /// In the order of the log times.
    pub(crate) images: Vec<i64>,
    pub(crate) exposures: BTreeSet<i64>,
}

impl Captures {
    pub(crate) fn find(bag: &Bag) -> Result<Self, RecordingError> {
        let mut found = Self::default();
        for message in bag.messages_where(|topic| camera_of(&topic.name, &topic.type_name).is_some()) {
            let message = message?;
            let Some(camera) = camera_of(&message.topic.name, &message.topic.type_name) else {
                continue;
            };
            if message.topic.type_name == Image::TYPE_NAME {
                let images = &mut found.cameras.entry(camera.to_owned()).or_default().images;
                images.extend(header_stamp(&message));
            } else if let Ok(exposure) = cdr::from_slice::<Exposure>(&message.cdr) {
                found.add(camera, &exposure, &message);
            }
        }
        found.join();
        Ok(found)
    }

    fn add(&mut self, camera: &str, exposure: &Exposure, message: &RawMessage) {
        let stamp = exposure.header.stamp.to_nanos();
        let seen = &mut self.cameras.entry(camera.to_owned()).or_default().exposures;
        seen.insert(stamp);
        let known = self
            .captures
            .iter()
            .position(|capture| capture.id == exposure.capture_id);
        let position = known.unwrap_or_else(|| {
            self.captures.push(Capture {
                number: self.captures.len() + 1,
                id: exposure.capture_id.clone(),
                stamp,
                cameras: Vec::new(),
                span: (message.log_time, message.log_time),
            });
            self.captures.len() - 1
        });
        self.captures[position].add(camera, exposure, message.log_time);
    }

    /// Says of every exposure whether its image is there, and sorts.
    fn join(&mut self) {
        for capture in &mut self.captures {
            capture.cameras.sort_by(|a, b| a.camera.cmp(&b.camera));
            for part in &mut capture.cameras {
                let images: BTreeSet<i64> = self
                    .cameras
                    .get(&part.camera)
                    .map(|camera| camera.images.iter().copied().collect())
                    .unwrap_or_default();
                part.exposures.sort_by_key(|exposure| exposure.index);
                for exposure in &mut part.exposures {
                    exposure.has_image = images.contains(&exposure.stamp);
                }
            }
        }
    }
}

impl Capture {
    fn add(&mut self, camera: &str, exposure: &Exposure, log_time: u64) {
        let stamp = exposure.header.stamp.to_nanos();
        self.stamp = self.stamp.min(stamp);
        self.span = (self.span.0.min(log_time), self.span.1.max(log_time));
        let known = self.cameras.iter().position(|part| part.camera == camera);
        let position = known.unwrap_or_else(|| {
            self.cameras.push(CameraCapture {
                camera: camera.to_owned(),
                count: exposure.count,
                exposures: Vec::new(),
            });
            self.cameras.len() - 1
        });
        self.cameras[position].exposures.push(ExposureReport {
            index: exposure.index,
            light: light(exposure.channel),
            stamp,
            has_image: false,
        });
    }
}

impl CameraCapture {
    /// Images of the sequence that are there.
    pub(crate) fn images(&self) -> usize {
        let there = self
            .exposures
            .iter()
            .filter(|exposure| exposure.has_image && exposure.index < self.count);
        there.map(|exposure| exposure.index).collect::<BTreeSet<u8>>().len()
    }

    /// Why it is not whole.
    pub(crate) fn faults(&self) -> Vec<String> {
        let with = |index: u8| self.exposures.iter().filter(|exposure| exposure.index == index).count();
        let missing: Vec<String> = (0..self.count)
            .filter(|i| with(*i) == 0)
            .map(|i| i.to_string())
            .collect();
        let again: Vec<String> = (0..self.count)
            .filter(|i| with(*i) > 1)
            .map(|i| i.to_string())
            .collect();
        let beyond = self.exposures.iter().filter(|exposure| exposure.index >= self.count);
        let beyond: Vec<String> = beyond.map(|exposure| exposure.index.to_string()).collect();
        let count = self.count;
        let faults = [
            (missing, format!("of {count} exposures missing: index")),
            (again, format!("of {count} exposures more than once: index")),
            (beyond, format!("beyond the {count} exposures: index")),
        ];
        let told = faults.into_iter().filter(|(indices, _)| !indices.is_empty());
        told.map(|(indices, what)| format!("{what} {}", indices.join(", ")))
            .collect()
    }
}

/// The camera that an image or exposure topic belongs to: `/cell/c1` of `/cell/c1/image_raw`.
pub(crate) fn camera_of<'a>(topic: &'a str, type_name: &str) -> Option<&'a str> {
    match type_name {
        Image::TYPE_NAME => topic.strip_suffix("/image_raw"),
        Exposure::TYPE_NAME => topic.strip_suffix("/exposure"),
        _ => None,
    }
}

fn light(channel: u8) -> String {
    match channel {
        0 => "dark".to_owned(),
        panel => format!("L{panel}"),
    }
}
