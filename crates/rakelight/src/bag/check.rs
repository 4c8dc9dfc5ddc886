//! `rakelight bag check`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use interfaces::Message;
use interfaces::sensor_msgs::msg::CameraInfo;
use recording::Bag;
use serde::Serialize;

use super::captures::{Camera, Capture, Captures};
use super::message::Decoders;
use super::text::count;
use super::{open, print_json};
use crate::failure::Failure;

/// Problems of one kind that are printed one by one.
const SHOWN: usize = 10;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Bag folder or .mcap file.
    bag: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let bag = open(&arguments.bag)?;
    let check = Check::of(&bag)?;
    if arguments.json {
        print_json(&check)?;
    } else {
        for line in check.lines() {
            println!("{line}");
        }
    }
    if check.problems.is_empty() {
        return Ok(());
    }
    let (path, problems) = (arguments.bag.display(), count(check.problems.len(), "problem"));
    Err(Failure::from(anyhow!("{path} is not in order: {problems}")))
}

#[derive(Serialize)]
struct Check {
    messages: usize,
    captures: usize,
    /// Topics whose messages could not be looked at.
    unchecked_topics: Vec<String>,
    problems: Vec<Problem>,
}

#[derive(Serialize)]
struct Problem {
    kind: Kind,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    byte: Option<u64>,
    /// What and where, for people.
    message: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Damage,
    Undecodable,
    CaptureIncomplete,
    ExposureWithoutImage,
    ImageWithoutExposure,
    StampsOutOfOrder,
    NoCalibration,
}

impl Problem {
    fn new(kind: Kind, message: String) -> Self {
        Self {
            kind,
            file: None,
            byte: None,
            message,
        }
    }
}

impl Check {
    fn of(bag: &Bag) -> Result<Self, Failure> {
        let decoders = Decoders::new();
        let found = Captures::find(bag)?;
        let mut problems = damage(bag);
        problems.extend(undecodable(bag, &decoders)?);
        problems.extend(found.captures.iter().flat_map(incomplete));
        // Images without any exposure are not the cell's.
        for (name, camera) in found.cameras.iter().filter(|(_, camera)| !camera.exposures.is_empty()) {
            problems.extend(unpaired(name, camera));
            problems.extend(out_of_order(name, camera));
            problems.extend(uncalibrated(name, bag));
        }
        let unknown = bag.topics().iter().filter(|topic| !decoders.know(topic));
        Ok(Self {
            messages: bag.report().messages,
            captures: found.captures.len(),
            unchecked_topics: unknown
                .map(|topic| format!("{} ({})", topic.name, topic.type_name))
                .collect(),
            problems,
        })
    }

    fn lines(&self) -> Vec<String> {
        let (messages, captures) = (count(self.messages, "message"), count(self.captures, "capture"));
        let mut lines = vec![format!("{messages}, {captures}")];
        if !self.unchecked_topics.is_empty() {
            lines.push(format!(
                "not looked into, types unknown: {}",
                self.unchecked_topics.join(", ")
            ));
        }
        let mut kinds: BTreeMap<Kind, Vec<&Problem>> = BTreeMap::new();
        for problem in &self.problems {
            kinds.entry(problem.kind).or_default().push(problem);
        }
        for problems in kinds.values() {
            lines.extend(problems.iter().take(SHOWN).map(|problem| problem.message.clone()));
            if problems.len() > SHOWN {
                lines.push(format!(
                    "... and {} more of this kind (--json lists all)",
                    problems.len() - SHOWN
                ));
            }
        }
        if self.problems.is_empty() {
            lines.push("everything is in order".to_owned());
        }
        lines
    }
}

fn damage(bag: &Bag) -> Vec<Problem> {
    let problem = |damage: &recording::Damage| Problem {
        file: Some(damage.file.clone()),
        byte: Some(damage.offset),
        ..Problem::new(Kind::Damage, damage.to_string())
    };
    bag.report().damage.iter().map(problem).collect()
}

fn undecodable(bag: &Bag, decoders: &Decoders) -> Result<Vec<Problem>, Failure> {
    let mut problems = Vec::new();
    for message in bag.messages_where(|topic| decoders.know(topic)) {
        let message = message?;
        if let Err(error) = decoders.check(&message) {
            let text = format!("{} at {} ns: {error}", message.topic.name, message.log_time);
            problems.push(Problem::new(Kind::Undecodable, text));
        }
    }
    Ok(problems)
}

fn incomplete(capture: &Capture) -> Vec<Problem> {
    let mut problems = Vec::new();
    for part in &capture.cameras {
        let place = format!("capture {:?}, {}", capture.id, part.camera);
        let fault = |fault| Problem::new(Kind::CaptureIncomplete, format!("{place}: {fault}"));
        problems.extend(part.faults().into_iter().map(fault));
        for exposure in part.exposures.iter().filter(|exposure| !exposure.has_image) {
            let (index, light, stamp) = (exposure.index, &exposure.light, exposure.stamp);
            let text = format!("{place}: exposure {index} ({light}) has no image of its stamp, {stamp} ns");
            problems.push(Problem::new(Kind::ExposureWithoutImage, text));
        }
    }
    problems
}

fn unpaired(name: &str, camera: &Camera) -> Vec<Problem> {
    let lonely = camera.images.iter().filter(|stamp| !camera.exposures.contains(stamp));
    let problem = |stamp: &i64| {
        let text = format!("{name}/image_raw: no exposure has the stamp of the image, {stamp} ns");
        Problem::new(Kind::ImageWithoutExposure, text)
    };
    lonely.map(problem).collect()
}

fn out_of_order(name: &str, camera: &Camera) -> Vec<Problem> {
    let back = camera.images.windows(2).filter(|pair| pair[1] <= pair[0]);
    let problem = |pair: &[i64]| {
        let text = format!("{name}/image_raw: stamp {} ns follows {} ns", pair[1], pair[0]);
        Problem::new(Kind::StampsOutOfOrder, text)
    };
    back.map(problem).collect()
}

fn uncalibrated(name: &str, bag: &Bag) -> Option<Problem> {
    let topic = format!("{name}/camera_info");
    let is_there = |known: &recording::Topic| {
        known.name == topic && known.type_name == CameraInfo::TYPE_NAME && known.message_count > 0
    };
    let missing = !bag.topics().iter().any(|known| is_there(known));
    missing.then(|| Problem::new(Kind::NoCalibration, format!("{topic}: not a single message")))
}
