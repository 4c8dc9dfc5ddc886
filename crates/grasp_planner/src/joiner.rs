//! Puts together what is published of one view. Maps come on topics of their own, in any order; the stamp of the
//! capture's first image joins them, and that image's exposure says which capture it is.

use std::collections::VecDeque;
use std::sync::Arc;

use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::Image;

/// Topics below the camera's, in the order of [`Maps`].
pub(crate) const MAPS: [&str; 6] = ["normals", "confidence", "mask", "depth", "edges", "edge_confidence"];

/// Maps of one view: `MAPS[i]` is the topic of the i-th.
pub(crate) type Maps = [Arc<Image>; MAPS.len()];

/// Captures whose results may still come.
const REMEMBERED: usize = 8;

/// One camera's results on their way in.
#[derive(Default)]
pub(crate) struct Joiner {
    /// The newest of each.
    maps: [Option<Arc<Image>>; MAPS.len()],
    /// First images, oldest first.
    captures: VecDeque<(Time, String)>,
}

impl Joiner {
    /// Takes an exposure; gives the id of the capture that it begins, if it does.
    pub(crate) fn add_exposure(&mut self, exposure: &Exposure) -> Option<String> {
        if exposure.index != 0 {
            return None;
        }
        self.captures.retain(|(_, id)| *id != exposure.capture_id);
        if self.captures.len() == REMEMBERED {
            self.captures.pop_front();
        }
        let id = exposure.capture_id.clone();
        self.captures.push_back((exposure.header.stamp, id.clone()));
        Some(id)
    }

    /// Takes the `which`-th map.
    pub(crate) fn add_map(&mut self, which: usize, map: Arc<Image>) {
        self.maps[which] = Some(map);
    }

    /// The id and all maps of a capture, once each of them is there.
    pub(crate) fn take_whole(&mut self) -> Option<(String, Maps)> {
        let stamp = self.maps[0].as_ref()?.header.stamp;
        let (_, id) = self.captures.iter().find(|(first, _)| *first == stamp)?;
        let of_capture = |map: &Option<Arc<Image>>| map.as_ref().is_some_and(|map| map.header.stamp == stamp);
        if !self.maps.iter().all(of_capture) {
            return None;
        }
        let maps: Vec<_> = self.maps.iter_mut().filter_map(Option::take).collect();
        Some((id.clone(), Maps::try_from(maps).ok()?))
    }

    /// Which maps of the newest normals' capture have not come; none while there are no normals.
    pub(crate) fn lacking(&self) -> Option<(String, Vec<&'static str>)> {
        let stamp = self.maps[0].as_ref()?.header.stamp;
        let (_, id) = self.captures.iter().find(|(first, _)| *first == stamp)?;
        let is_there = |map: &Option<Arc<Image>>| map.as_ref().is_some_and(|map| map.header.stamp == stamp);
        let names = self.maps.iter().zip(MAPS).filter(|(map, _)| !is_there(map));
        Some((id.clone(), names.map(|(_, name)| name).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(sec: i32) -> Time {
        Time { sec, nanosec: 5 }
    }

    fn exposure(capture_id: &str, index: u8, sec: i32) -> Exposure {
        let mut exposure = Exposure {
            capture_id: capture_id.into(),
            index,
            count: 8,
            ..Exposure::default()
        };
        exposure.header.stamp = stamp(sec);
        exposure
    }

    fn map(sec: i32) -> Arc<Image> {
        let mut image = Image::default();
        image.header.stamp = stamp(sec);
        Arc::new(image)
    }

    #[test]
    fn a_view_is_whole_in_whatever_order_it_comes_and_given_once() {
        for last in 0..=MAPS.len() {
            let mut joiner = Joiner::default();
            if last != MAPS.len() {
                assert_eq!(joiner.add_exposure(&exposure("a", 0, 1)).as_deref(), Some("a"));
            }
            for which in (0..MAPS.len()).rev().filter(|which| *which != last) {
                joiner.add_map(which, map(1));
                assert!(joiner.take_whole().is_none());
            }
            if last == MAPS.len() {
                joiner.add_exposure(&exposure("a", 0, 1));
            } else {
                joiner.add_map(last, map(1));
            }
            assert_eq!(joiner.take_whole().expect("whole").0, "a");
            assert!(joiner.take_whole().is_none());
        }
    }

    #[test]
    fn maps_of_two_captures_are_never_mixed() {
        let mut joiner = Joiner::default();
        joiner.add_exposure(&exposure("a", 0, 1));
        joiner.add_exposure(&exposure("b", 0, 2));
        for which in 0..MAPS.len() {
            joiner.add_map(which, map(if which == 3 { 1 } else { 2 }));
        }
        assert!(joiner.take_whole().is_none());
        assert_eq!(joiner.lacking(), Some(("b".into(), vec!["depth"])));
        joiner.add_map(3, map(2));
        assert_eq!(joiner.take_whole().expect("whole").0, "b");
    }

    #[test]
    fn exposures_after_the_first_and_stamps_of_no_capture_begin_nothing() {
        let mut joiner = Joiner::default();
        assert_eq!(joiner.add_exposure(&exposure("a", 1, 1)), None);
        for which in 0..MAPS.len() {
            joiner.add_map(which, map(1));
        }
        assert!(joiner.take_whole().is_none() && joiner.lacking().is_none());
    }

    #[test]
    fn old_captures_are_forgotten() {
        let mut joiner = Joiner::default();
        for sec in 0..100 {
            joiner.add_exposure(&exposure(&sec.to_string(), 0, sec));
        }
        assert_eq!(joiner.captures.len(), REMEMBERED);
        assert_eq!(joiner.captures[0].1, "92");
    }
}
