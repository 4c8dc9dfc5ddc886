//! `rakelight bag cut`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::Args;
use interfaces::Message;
use interfaces::rakelight_msgs::msg::CellState;
use recording::{Bag, BagWriter, RawMessage, Topic, TopicId};
use serde::Serialize;

use super::captures::{Capture, Captures};
use super::message::header_stamp;
use super::text::count;
use super::{DamageReport, open, print_json};
use crate::failure::Failure;

/// What lies around a capture in time goes with it: transforms, joints, lights.
const MARGIN: u64 = 1_000_000_000;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Bag folder or .mcap file.
    bag: PathBuf,
    /// Folder of the new bag.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Leave out what is earlier, in seconds from the beginning of the bag.
    #[arg(long, value_name = "S", value_parser = seconds)]
    from: Option<f64>,
    /// Leave out what is later, in seconds from the beginning of the bag.
    #[arg(long, value_name = "S", value_parser = seconds)]
    to: Option<f64>,
    /// Keep these captures, by their number or id in `bag info`, and what lies around them in time.
    #[arg(long, value_name = "N|ID", num_args = 1..)]
    capture: Vec<String>,
    /// Keep these topics.
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    topics: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().map_err(|error| error.to_string())?;
    let is_time = value.is_finite() && value >= 0.0;
    is_time
        .then_some(value)
        .ok_or_else(|| "allowed: 0 or more seconds".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let bag = open(&arguments.bag)?;
    let selection = Selection::new(arguments, &bag)?;
    if arguments.output.exists() {
        let path = arguments.output.display();
        return Err(Failure::usage(anyhow!(
            "{path} exists already; a bag is never overwritten"
        )));
    }
    if !bag
        .messages()
        .any(|message| message.is_ok_and(|message| selection.wants(&message)))
    {
        return Err(Failure::from(anyhow!(
            "nothing of {} is selected",
            arguments.bag.display()
        )));
    }
    let cut = Cut::write(&bag, &selection, &arguments.output)?;
    if arguments.json {
        return print_json(&cut);
    }
    for damage in &bag.report().damage {
        eprintln!("rakelight: not copied: {damage}");
    }
    let (messages, latched) = (count(cut.messages, "message"), cut.latched);
    println!(
        "{}: {messages}, {latched} of them latched before the cut",
        cut.path.display()
    );
    Ok(())
}

/// Writes one capture, by its number or id, and what lies around it in time as a new bag; of these topics.
pub(crate) fn one_capture(bag: &Bag, capture: &str, topics: &[String], output: &Path) -> Result<(), Failure> {
    let selection = Selection {
        span: (0, u64::MAX),
        topics: known_topics(topics, bag)?,
        captures: known_captures(&[capture.to_owned()], bag)?,
    };
    Cut::write(bag, &selection, output).map(drop)
}

/// What of a bag is kept.
struct Selection {
    /// Log times, both ends included.
    span: (u64, u64),
    topics: Option<BTreeSet<String>>,
    captures: Option<SelectedCaptures>,
}

struct SelectedCaptures {
    /// Stamps of their images, and so of everything that was computed from them.
    stamps: BTreeSet<i64>,
    /// Cameras of the bag, `/cell/c1`.
    cameras: Vec<String>,
    /// Log times around them.
    spans: Vec<(u64, u64)>,
}

impl Selection {
    fn new(arguments: &Arguments, bag: &Bag) -> Result<Self, Failure> {
        let (first, last) = bag.report().span.unwrap_or_default();
        let at = |seconds: f64| first.saturating_add((seconds * 1e9).round() as u64);
        let span = (arguments.from.map_or(first, at), arguments.to.map_or(last, at));
        if span.0 > span.1 {
            return Err(Failure::usage(anyhow!(
                "--from is later than --to or than the end of the bag"
            )));
        }
        Ok(Self {
            span,
            topics: known_topics(&arguments.topics, bag)?,
            captures: known_captures(&arguments.capture, bag)?,
        })
    }

    /// Topics asked for by name; all of them otherwise.
    fn has_topic(&self, topic: &Topic) -> bool {
        self.topics.as_ref().is_none_or(|topics| topics.contains(&topic.name))
    }

    fn wants(&self, message: &RawMessage) -> bool {
        let time = message.log_time;
        self.has_topic(&message.topic)
            && (self.span.0..=self.span.1).contains(&time)
            && self.captures.as_ref().is_none_or(|captures| captures.want(message))
    }

    /// The beginning of the stretch of time that a wanted message belongs to.
    fn start_for(&self, message: &RawMessage) -> u64 {
        let spans = self.captures.iter().flat_map(|captures| &captures.spans);
        let around = spans
            .filter(|span| (span.0..=span.1).contains(&message.log_time))
            .map(|span| span.0)
            .min();
        around
            .map_or(message.log_time, |start| start.max(self.span.0))
            .min(message.log_time)
    }
}

impl SelectedCaptures {
    fn want(&self, message: &RawMessage) -> bool {
        if header_stamp(message).is_some_and(|stamp| self.stamps.contains(&stamp)) {
            return true;
        }
        let name = &message.topic.name;
        let of_camera = self
            .cameras
            .iter()
            .any(|camera| name.strip_prefix(camera).is_some_and(|rest| rest.starts_with('/')));
        !of_camera
            && self
                .spans
                .iter()
                .any(|span| (span.0..=span.1).contains(&message.log_time))
    }
}

fn known_topics(asked: &[String], bag: &Bag) -> Result<Option<BTreeSet<String>>, Failure> {
    let known: BTreeSet<&str> = bag.topics().iter().map(|topic| topic.name.as_str()).collect();
    if let Some(unknown) = asked.iter().find(|name| !known.contains(name.as_str())) {
        let known: Vec<&str> = known.into_iter().collect();
        return Err(Failure::usage(anyhow!(
            "no topic {unknown} in the bag; it has {}",
            known.join(", ")
        )));
    }
    Ok((!asked.is_empty()).then(|| asked.iter().cloned().collect()))
}

fn known_captures(asked: &[String], bag: &Bag) -> Result<Option<SelectedCaptures>, Failure> {
    if asked.is_empty() {
        return Ok(None);
    }
    let found = Captures::find(bag)?;
    let mut selected = SelectedCaptures {
        stamps: BTreeSet::new(),
        cameras: found.cameras.keys().cloned().collect(),
        spans: Vec::new(),
    };
    for name in asked {
        let by_id = found.captures.iter().find(|capture| capture.id == *name);
        let by_number = || {
            found
                .captures
                .iter()
                .find(|capture| capture.number.to_string() == *name)
        };
        let capture = by_id
            .or_else(by_number)
            .ok_or_else(|| unknown_capture(name, &found.captures))?;
        let exposures = capture.cameras.iter().flat_map(|part| &part.exposures);
        selected.stamps.extend(exposures.map(|exposure| exposure.stamp));
        let (first, last) = capture.span;
        selected
            .spans
            .push((first.saturating_sub(MARGIN), last.saturating_add(MARGIN)));
    }
    Ok(Some(selected))
}

fn unknown_capture(name: &str, captures: &[Capture]) -> Failure {
    let known: Vec<String> = captures
        .iter()
        .map(|capture| format!("{} ({})", capture.number, capture.id))
        .collect();
    let known = if known.is_empty() {
        "none".to_owned()
    } else {
        known.join(", ")
    };
    Failure::usage(anyhow!("no capture {name} in the bag; it has {known}"))
}

/// What was written.
#[derive(Serialize)]
struct Cut {
    path: PathBuf,
    messages: usize,
    /// Of them, those that were latched before the cut; they come at its beginning.
    latched: usize,
    topics: usize,
    /// What could not be copied.
    damage: Vec<DamageReport>,
}

impl Cut {
    fn write(bag: &Bag, selection: &Selection, output: &Path) -> Result<Self, Failure> {
        let mut writer = BagWriter::create(output)?;
        let mut ids = BTreeMap::new();
        for topic in bag.topics().iter().filter(|topic| selection.has_topic(topic)) {
            ids.insert(topic.name.as_str(), writer.add_topic_like(topic)?);
        }
        let (mut messages, mut latched) = (0, 0);
        let mut kept = Latched::default();
        for message in bag.messages_where(|topic| ids.contains_key(topic.name.as_str())) {
            let message = message?;
            if !selection.wants(&message) {
                kept.keep(message);
                continue;
            }
            let start = selection.start_for(&message);
            for early in kept.take() {
                put(&mut writer, &ids, &early, start)?;
                latched += 1;
            }
            put(&mut writer, &ids, &message, message.log_time)?;
            messages += 1;
        }
        writer.finish()?;
        Ok(Self {
            path: output.to_owned(),
            messages: messages + latched,
            latched,
            topics: ids.len(),
            damage: bag.report().damage.iter().map(DamageReport::from).collect(),
        })
    }
}

fn put(
    writer: &mut BagWriter,
    ids: &BTreeMap<&str, TopicId>,
    message: &RawMessage,
    log_time: u64,
) -> Result<(), Failure> {
    // Only messages of topics that have an id are read.
    if let Some(id) = ids.get(message.topic.name.as_str()) {
        writer.write_published(*id, log_time, message.publish_time, &message.cdr)?;
    }
    Ok(())
}

/// What a latecomer would have been given: the last message of latched topics, and every static transform.
#[derive(Default)]
struct Latched(BTreeMap<String, Vec<RawMessage>>);

impl Latched {
    fn keep(&mut self, message: RawMessage) {
        if !is_latched(&message.topic) {
            return;
        }
        let kept = self.0.entry(message.topic.name.clone()).or_default();
        if !message.topic.name.ends_with("tf_static") {
            kept.clear();
        }
        kept.push(message);
    }

    fn take(&mut self) -> Vec<RawMessage> {
        std::mem::take(&mut self.0).into_values().flatten().collect()
    }
}

fn is_latched(topic: &Topic) -> bool {
    let by_name = ["camera_info", "tf_static", "robot_description"]
        .iter()
        .any(|end| topic.name.ends_with(end));
    by_name || topic.type_name == CellState::TYPE_NAME || topic.options.is_transient_local()
}
