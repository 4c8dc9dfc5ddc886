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

/// Captures under way at a time.
const MAX_PENDING: usize = 4;

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

/// A capture under way: its exposures by index.
struct Pending {
    id: String,
    count: u8,
    exposures: BTreeMap<u8, Arc<Exposure>>,
}

/// Collects one camera's captures. The small exposures of a capture may overtake the large images of the one before, so
/// more than one may be under way.
#[derive(Default)]
pub(crate) struct Assembler {
    /// Oldest first.
    pending: Vec<Pending>,
    images: BTreeMap<Stamp, Arc<Image>>,
    voids: Vec<Void>,
}

impl Assembler {
    /// Takes an exposure; whether it begins a capture. One that repeats an index begins its capture anew.
    pub(crate) fn add_exposure(&mut self, exposure: Arc<Exposure>) -> bool {
        let same = |p: &Pending| p.id == exposure.capture_id && p.count == exposure.count;
        let known = self.pending.iter().position(same);
        let (at, begins) = match known {
            Some(at) if !self.pending[at].exposures.contains_key(&exposure.index) => (at, false),
            repeated => {
                if let Some(at) = repeated {
                    self.give_up(at, "it began anew");
                }
                (self.begin(&exposure), true)
            }
        };
        self.pending[at].exposures.insert(exposure.index, exposure);
        begins
    }

    /// Takes an image. Gives back the number of images that were given up because no exposure names them.
    pub(crate) fn add_image(&mut self, image: Arc<Image>) -> usize {
        self.images.insert(stamp(image.header.stamp), image);
        let exposures = self.pending.iter().flat_map(|p| p.exposures.values());
        let named: Vec<Stamp> = exposures.map(|e| stamp(e.header.stamp)).collect();
        let unnamed: Vec<Stamp> = self.images.keys().filter(|s| !named.contains(s)).copied().collect();
        let too_many = unnamed.len().saturating_sub(MAX_WAITING_IMAGES);
        for oldest in &unnamed[..too_many] {
            self.images.remove(oldest);
        }
        too_many
    }

    /// The oldest capture of which every image is there. Those before it are void: their images are older still.
    pub(crate) fn take_whole(&mut self) -> Option<Capture> {
        let at = self
            .pending
            .iter()
            .position(|p| self.arrived(p) == usize::from(p.count))?;
        for _ in 0..at {
            self.give_up(0, "a later capture was whole");
        }
        let Pending { id, exposures, .. } = self.pending.remove(0);
        let frames = exposures
            .into_values()
            .filter_map(|exposure| {
                let image = self.images.remove(&stamp(exposure.header.stamp))?;
                Some(Frame { exposure, image })
            })
            .collect();
        Some(Capture { id, frames })
    }

    /// Ends every capture under way.
    pub(crate) fn give_up_all(&mut self, why: &str) {
        while !self.pending.is_empty() {
            self.give_up(0, why);
        }
    }

    /// What was given up since the last call.
    pub(crate) fn take_voids(&mut self) -> Vec<Void> {
        std::mem::take(&mut self.voids)
    }

    fn begin(&mut self, exposure: &Exposure) -> usize {
        if self.pending.len() == MAX_PENDING {
            self.give_up(0, "too many others began");
        }
        let (id, count) = (exposure.capture_id.clone(), exposure.count);
        self.pending.push(Pending {
            id,
            count,
            exposures: BTreeMap::new(),
        });
        self.pending.len() - 1
    }

    fn give_up(&mut self, at: usize, why: &str) {
        let arrived = self.arrived(&self.pending[at]);
        let Pending { id, count, exposures } = self.pending.remove(at);
        for exposure in exposures.into_values() {
            self.images.remove(&stamp(exposure.header.stamp));
        }
        let reason = format!("{why} when {arrived} of {count} images had arrived");
        self.voids.push(Void { capture_id: id, reason });
    }

    fn arrived(&self, pending: &Pending) -> usize {
        pending
            .exposures
            .values()
            .filter(|e| self.images.contains_key(&stamp(e.header.stamp)))
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

    fn add_exposures(assembler: &mut Assembler, capture: &str, sec: i32) {
        for index in 0..COUNT {
            let begins = assembler.add_exposure(exposure(capture, index, sec));
            assert_eq!(begins, index == 0);
        }
    }

    #[test]
    fn a_capture_is_whole_in_whatever_order_it_arrives() {
        let mut assembler = Assembler::default();
        for index in [2, 0, 3] {
            assert_eq!(assembler.add_image(image(index, 1)), 0);
        }
        let begins = [3, 1, 0, 2].map(|index| assembler.add_exposure(exposure("a", index, 1)));
        assert_eq!(begins, [true, false, false, false]);
        assert!(assembler.take_whole().is_none());
        assembler.add_image(image(1, 1));
        let capture = assembler.take_whole().unwrap();
        let order: Vec<u8> = capture.frames.iter().map(|frame| frame.exposure.index).collect();
        assert_eq!((capture.id.as_str(), order), ("a", vec![0, 1, 2, 3]));
        assert_eq!(assembler.take_voids(), []);
    }

    #[test]
    fn exposures_may_overtake_the_images_of_the_capture_before() {
        let mut assembler = Assembler::default();
        for (capture, sec) in [("a", 1), ("b", 2)] {
            add_exposures(&mut assembler, capture, sec);
        }
        for (capture, sec) in [("a", 1), ("b", 2)] {
            for index in 0..COUNT {
                assembler.add_image(image(index, sec));
            }
            assert_eq!(assembler.take_whole().unwrap().id, capture);
        }
        assert_eq!(assembler.take_voids(), []);
    }

    #[test]
    fn a_whole_capture_voids_incomplete_ones_before_it() {
        let mut assembler = Assembler::default();
        for (capture, sec, images) in [("a", 1, COUNT - 1), ("b", 2, COUNT)] {
            add_exposures(&mut assembler, capture, sec);
            for index in 0..images {
                assembler.add_image(image(index, sec));
            }
        }
        assert_eq!(assembler.take_whole().unwrap().id, "b");
        let voids: Vec<String> = assembler.take_voids().iter().map(ToString::to_string).collect();
        assert_eq!(
            voids,
            ["capture \"a\" is void: a later capture was whole when 3 of 4 images had arrived"]
        );
        assert!(assembler.images.is_empty());
    }

    #[test]
    fn a_repeated_index_begins_the_capture_anew() {
        let mut assembler = Assembler::default();
        assert!(assembler.add_exposure(exposure("a", 0, 1)));
        for index in 0..COUNT {
            let begins = assembler.add_exposure(exposure("a", index, 2));
            assert_eq!(begins, index == 0);
            assembler.add_image(image(index, 2));
        }
        assert_eq!(assembler.take_whole().unwrap().frames[0].exposure.header.stamp.sec, 2);
        assert_eq!(assembler.take_voids().len(), 1);
    }

    #[test]
    fn nothing_piles_up() {
        let mut assembler = Assembler::default();
        let given_up: usize = (0..100).map(|sec| assembler.add_image(image(0, sec))).sum();
        assert_eq!(
            (assembler.images.len(), given_up),
            (MAX_WAITING_IMAGES, 100 - MAX_WAITING_IMAGES)
        );
        assert!((0..100).all(|n| assembler.add_exposure(exposure(&n.to_string(), 0, n))));
        assert_eq!(
            (assembler.pending.len(), assembler.take_voids().len()),
            (MAX_PENDING, 100 - MAX_PENDING)
        );
        assembler.give_up_all("the test ends");
        assert_eq!(assembler.take_voids().len(), MAX_PENDING);
    }
}
