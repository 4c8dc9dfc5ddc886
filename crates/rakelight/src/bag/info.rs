//! `rakelight bag info`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use recording::Bag;
use serde::Serialize;

use super::captures::{CameraCapture, Capture, Captures};
use super::text::{count, size, table, utc};
use super::{DamageReport, open, print_json};
use crate::failure::Failure;

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
    let info = Info::of(&bag)?;
    if arguments.json {
        return print_json(&info);
    }
    for line in info.lines(&arguments.bag.display().to_string()) {
        println!("{line}");
    }
    Ok(())
}

#[derive(Serialize)]
struct Info {
    files: Vec<File>,
    /// Log times, nanoseconds since the epoch.
    start: Option<u64>,
    end: Option<u64>,
    duration_s: f64,
    messages: usize,
    topics: Vec<TopicInfo>,
    captures: Vec<Capture>,
    damage: Vec<DamageReport>,
}

#[derive(Serialize)]
struct File {
    path: PathBuf,
    bytes: u64,
}

#[derive(Serialize)]
struct TopicInfo {
    name: String,
    r#type: String,
    messages: usize,
    bytes: u64,
    /// Between its first and last message; none with fewer than two.
    rate_hz: Option<f64>,
}

#[derive(Default)]
struct Flow {
    messages: usize,
    bytes: u64,
    first: u64,
    last: u64,
}

impl Info {
    fn of(bag: &Bag) -> Result<Self, Failure> {
        let report = bag.report();
        let files = report.files.iter().map(|path| {
            let bytes = std::fs::metadata(path)?.len();
            Ok(File {
                path: path.clone(),
                bytes,
            })
        });
        let (start, end) = report.span.unzip();
        let duration_s = report.span.map_or(0.0, |(start, end)| (end - start) as f64 * 1e-9);
        Ok(Self {
            files: files.collect::<std::io::Result<_>>()?,
            start,
            end,
            duration_s,
            messages: report.messages,
            topics: topics(bag),
            captures: Captures::find(bag)?.captures,
            damage: report.damage.iter().map(DamageReport::from).collect(),
        })
    }

    fn lines(&self, path: &str) -> Vec<String> {
        let mut lines = vec![format!("bag       {path}")];
        for file in &self.files {
            let name = file.path.file_name().unwrap_or_default().to_string_lossy();
            lines.push(format!("file      {name}, {}", size(file.bytes)));
        }
        let (duration, start) = (self.duration_s, self.start.map(utc));
        let from = start.map_or_else(String::new, |start| format!(", from {start}"));
        lines.push(format!("duration  {duration:.3} s{from}"));
        let (messages, topics) = (count(self.messages, "message"), count(self.topics.len(), "topic"));
        lines.push(format!("contents  {messages} on {topics}"));
        let rows: Vec<Vec<String>> = self.topics.iter().map(TopicInfo::row).collect();
        lines.extend(table(&rows, &[2, 3]).iter().map(|line| format!("  {line}")));
        lines.push(format!("captures  {}", self.captures.len()));
        lines.extend(self.captures.iter().flat_map(capture_lines));
        match self.damage.len() {
            0 => lines.push("damage    none".to_owned()),
            number => lines.push(format!("damage    {}", count(number, "place"))),
        }
        let place =
            |damage: &DamageReport| format!("  {} at byte {}: {}", damage.file.display(), damage.byte, damage.reason);
        lines.extend(self.damage.iter().map(place));
        lines
    }
}

fn topics(bag: &Bag) -> Vec<TopicInfo> {
    let mut flows: BTreeMap<(&str, &str), Flow> = BTreeMap::new();
    for topic in bag.topics() {
        flows.entry((&topic.name, &topic.type_name)).or_default();
    }
    for entry in bag.index() {
        let flow = flows.entry((&entry.topic.name, &entry.topic.type_name)).or_default();
        if flow.messages == 0 {
            flow.first = entry.log_time;
        }
        flow.last = entry.log_time;
        flow.messages += 1;
        flow.bytes += entry.bytes as u64;
    }
    let info = |((name, kind), flow): ((&str, &str), Flow)| TopicInfo {
        name: name.to_owned(),
        r#type: kind.to_owned(),
        messages: flow.messages,
        bytes: flow.bytes,
        rate_hz: (flow.last > flow.first)
            .then(|| (flow.messages - 1) as f64 / ((flow.last - flow.first) as f64 * 1e-9)),
    };
    flows.into_iter().map(info).collect()
}

impl TopicInfo {
    fn row(&self) -> Vec<String> {
        let rate = self
            .rate_hz
            .map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1} Hz"));
        vec![self.name.clone(), self.r#type.clone(), self.messages.to_string(), rate]
    }
}

fn capture_lines(capture: &Capture) -> Vec<String> {
    let mut lines = vec![format!("  {}  {}", capture.number, capture.id)];
    lines.extend(capture.cameras.iter().map(camera_line));
    lines
}

fn camera_line(part: &CameraCapture) -> String {
    let lights: Vec<String> = part
        .exposures
        .iter()
        .map(|exposure| {
            let missing = if exposure.has_image { "" } else { " (no image)" };
            format!("{}{missing}", exposure.light)
        })
        .collect();
    let (camera, images, of) = (&part.camera, part.images(), part.count);
    format!("     {camera}: {images} of {of} images, {}", lights.join(" "))
}
