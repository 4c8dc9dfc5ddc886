//! Collects the images of a capture. Images and exposures come on two topics, in any order between them; the stamp
//! joins them, and the exposure says which place the image has in which capture.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::Image;

/// Images that wait for their exposure; more than a sequence holds means that the exposures do not come.
const MAX_WAITING_IMAGES: usize = 16;

/// One image of a capture, with what was on.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    pub(crate) exposure: Arc<Exposure>,
    pub(crate) image: Arc<Image>,
}

/// All images of a capture, in the order of the sequence.
#[derive(Debug, Clone)]
pub(crate) struct Capture {
    pub(crate) id: String,
    pub(crate) frames: Vec<Frame>,
}

/// A capture that will not be solved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Void {
    pub(crate) capture_id: String,
    pub(crate) reason: String,
}

impl fmt::Display for Void {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "capture {:?} is void: {}", self.capture_id, self.reason)
    }
}

type Stamp = (i32, u32);

fn stamp(time: Time) -> Stamp {
    (time.sec, time.nanosec)
}

/// Collects one camera's captures, one at a time.
#[derive(Default)]
pub(crate) struct Assembler {
    /// Exposures of the capture under way, by index.
    exposures: BTreeMap<u8, Arc<Exposure>>,
    images: BTreeMap<Stamp, Arc<Image>>,
}

impl Assembler {
    /// Takes an exposure. One of another capture, or one that repeats, ends the capture under way.
    pub(crate) fn add_exposure(&mut self, exposure: Arc<Exposure>) -> Option<Void> {
        let continues = |first: &Exposure| first.capture_id == exposure.capture_id && first.count == exposure.count;
        let fits = self.exposures.values().next().is_none_or(|first| continues(first));
        let void = if fits && !self.exposures.contains_key(&exposure.index) {
            None
        } else {
            self.give_up("another capture began")
        };
        self.exposures.insert(exposure.index, exposure);
        void
    }

    /// Takes an image. Gives back the number of images that were given up because no exposure names them.
    pub(crate) fn add_image(&mut self, image: Arc<Image>) -> usize {
        self.images.insert(stamp(image.header.stamp), image);
        let named: Vec<Stamp> = self.exposures.values().map(|e| stamp(e.header.stamp)).collect();
        let before = self.images.len();
        while self.images.len() > MAX_WAITING_IMAGES {
            let Some(oldest) = self.images.keys().find(|s| !named.contains(s)).copied() else {
                break;
            };
            self.images.remove(&oldest);
        }
        before - self.images.len()
    }

    /// The capture, once every exposure is there with its image.
    pub(crate) fn take_whole(&mut self) -> Option<Capture> {
        let first = self.exposures.values().next()?;
        if self.exposures.len() < usize::from(first.count) || self.missing_images() > 0 {
            return None;
        }
        let id = first.capture_id.clone();
        let exposures = std::mem::take(&mut self.exposures).into_values();
        let frames = exposures
            .filter_map(|exposure| {
                let image = self.images.remove(&stamp(exposure.header.stamp))?;
                Some(Frame { exposure, image })
            })
            .collect();
        Some(Capture { id, frames })
    }

    /// Ends the capture under way, if there is one.
    pub(crate) fn give_up(&mut self, why: &str) -> Option<Void> {
        let first = self.exposures.values().next()?;
        let arrived = self.exposures.len() - self.missing_images();
        let reason = format!("{why} when {arrived} of {} images had arrived", first.count);
        let capture_id = first.capture_id.clone();
        for exposure in std::mem::take(&mut self.exposures).into_values() {
            self.images.remove(&stamp(exposure.header.stamp));
        }
        Some(Void { capture_id, reason })
    }

    fn missing_images(&self) -> usize {
        self.exposures
            .values()
            .filter(|e| !self.images.contains_key(&stamp(e.header.stamp)))
            .count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: u8 = 4;

    fn exposure(capture_id: &str, index: u8, sec: i32) -> Arc<Exposure> {
        let mut exposure = Exposure {
            capture_id: capture_id.into(),
            index,
            count: COUNT,
            ..Exposure::default()
        };
        exposure.header.stamp = Time {
            sec,
            nanosec: u32::from(index),
        };
        Arc::new(exposure)
    }

    fn image(index: u8, sec: i32) -> Arc<Image> {
        let mut image = Image::default();
        image.header.stamp = Time {
            sec,
            nanosec: u32::from(index),
        };
        Arc::new(image)
    }

    #[test]
    fn a_capture_is_whole_in_whatever_order_it_arrives() {
        let mut assembler = Assembler::default();
        for index in [2, 0, 3] {
            assert_eq!(assembler.add_image(image(index, 1)), 0);
        }
        for index in [3, 1, 0, 2] {
            assert_eq!(assembler.add_exposure(exposure("a", index, 1)), None);
        }
        assert!(assembler.take_whole().is_none());
        assembler.add_image(image(1, 1));
        let capture = assembler.take_whole().unwrap();
        let order: Vec<u8> = capture.frames.iter().map(|frame| frame.exposure.index).collect();
        assert_eq!((capture.id.as_str(), order), ("a", vec![0, 1, 2, 3]));
    }

    #[test]
    fn a_new_capture_voids_an_incomplete_one() {
        let mut assembler = Assembler::default();
        for index in 0..3 {
            assembler.add_image(image(index, 1));
            assembler.add_exposure(exposure("a", index, 1));
        }
        let void = assembler.add_exposure(exposure("b", 0, 2)).unwrap();
        assert_eq!(
            void.to_string(),
            "capture \"a\" is void: another capture began when 3 of 4 images had arrived"
        );
        assembler.add_image(image(0, 2));
        for index in 1..COUNT {
            assembler.add_image(image(index, 2));
            assert_eq!(assembler.add_exposure(exposure("b", index, 2)), None);
        }
        assert_eq!(assembler.take_whole().unwrap().id, "b");
    }

    #[test]
    fn images_that_no_exposure_names_do_not_pile_up() {
        let mut assembler = Assembler::default();
        let given_up: usize = (0..100).map(|sec| assembler.add_image(image(0, sec))).sum();
        assert_eq!(
            (assembler.images.len(), given_up),
            (MAX_WAITING_IMAGES, 100 - MAX_WAITING_IMAGES)
        );
    }
}
