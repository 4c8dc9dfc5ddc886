//! What is told of a capture.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

use interfaces::rakelight_msgs::srv::CaptureResponse;
use serde::Serialize;

use super::pictures::light;
use super::receiver::Frames;

/// One capture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Report {
    capture_id: String,
    /// Seconds since 1970 of its first image.
    stamp: f64,
    cameras: BTreeMap<String, Images>,
    /// Sequences that were void and repeated.
    repeats: u8,
    /// From the call to its answer: by then the capture is known to be whole.
    answered_milliseconds: f64,
    /// From the call to the last image here.
    received_milliseconds: f64,
    /// Sheets that were written; the images are in a folder beside them.
    pictures: Vec<PathBuf>,
}

/// A camera's share.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Images {
    count: usize,
    width: u32,
    height: u32,
    /// "dark", "L1", ... in order.
    lights: Vec<String>,
    /// Largest value of any image, digital numbers of 16 bits.
    brightest: u16,
}

impl Report {
    pub(super) fn new(
        response: &CaptureResponse,
        frames: &Frames,
        answered: Duration,
        received: Duration,
        pictures: Vec<PathBuf>,
    ) -> Self {
        Self {
            capture_id: response.capture_id.clone(),
            stamp: f64::from(response.stamp.sec) + f64::from(response.stamp.nanosec) * 1e-9,
            cameras: frames
                .iter()
                .map(|(name, frames)| (name.clone(), images(frames)))
                .collect(),
            repeats: response.repeats,
            answered_milliseconds: answered.as_secs_f64() * 1e3,
            received_milliseconds: received.as_secs_f64() * 1e3,
            pictures,
        }
    }

    pub(super) fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }

    pub(super) fn for_people(&self) -> String {
        let mut text = format!(
            "capture {}: {:.0} ms, every image here after {:.0} ms, repeats: {}",
            self.capture_id, self.answered_milliseconds, self.received_milliseconds, self.repeats
        );
        for (name, images) in &self.cameras {
            let full = 100.0 * f64::from(images.brightest) / f64::from(u16::MAX);
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "\n  {name}: {} images of {} x {} ({}), brightest {full:.0} % of full scale",
                images.count,
                images.width,
                images.height,
                images.lights.join(" ")
            );
        }
        for picture in &self.pictures {
            let _ = write!(text, "\n  picture: {}", picture.display());
        }
        text
    }
}

fn images(frames: &[super::receiver::Frame]) -> Images {
    let first = frames.first().map(|frame| &frame.image);
    let values = frames.iter().flat_map(|frame| frame.image.data.chunks_exact(2));
    Images {
        count: frames.len(),
        width: first.map_or(0, |image| image.width),
        height: first.map_or(0, |image| image.height),
        lights: frames.iter().map(|frame| light(frame.exposure.channel)).collect(),
        brightest: values
            .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
            .max()
            .unwrap_or(0),
    }
}

/// Of several captures.
pub(super) fn summary(reports: &[Report]) -> String {
    let mut times: Vec<f64> = reports.iter().map(|report| report.answered_milliseconds).collect();
    times.sort_by(f64::total_cmp);
    let repeats: u32 = reports.iter().map(|report| u32::from(report.repeats)).sum();
    format!(
        "{} captures: {:.0} ms in the median, {:.0} ms at most, repeats: {repeats}",
        times.len(),
        times.get(times.len() / 2).unwrap_or(&0.0),
        times.last().unwrap_or(&0.0)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(milliseconds: f64) -> Report {
        let images = Images {
            count: 2,
            width: 4,
            height: 3,
            lights: vec!["dark".into(), "L1".into()],
            brightest: 52_428,
        };
        Report {
            capture_id: "abc".into(),
            stamp: 1.5,
            cameras: BTreeMap::from([("c1".into(), images)]),
            repeats: 1,
            answered_milliseconds: milliseconds,
            received_milliseconds: 2.0 * milliseconds,
            pictures: vec!["out/abc_c1.png".into()],
        }
    }

    #[test]
    fn a_capture_is_told_for_people_and_for_programs() {
        assert_eq!(
            report(112.4).for_people(),
            "capture abc: 112 ms, every image here after 225 ms, repeats: 1\n  \
             c1: 2 images of 4 x 3 (dark L1), brightest 80 % of full scale\n  picture: out/abc_c1.png"
        );
        let json: serde_json::Value = serde_json::from_str(&report(112.5).to_json().unwrap()).unwrap();
        assert_eq!(json["cameras"]["c1"]["lights"][1], "L1");
        assert_eq!(json["received_milliseconds"], 225.0);
    }

    #[test]
    fn several_captures_are_summed_up() {
        let reports = [report(300.0), report(100.0), report(200.0)];
        assert_eq!(
            summary(&reports),
            "3 captures: 200 ms in the median, 300 ms at most, repeats: 3"
        );
    }
}
