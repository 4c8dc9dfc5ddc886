//! What the node says of its bag.

use std::path::PathBuf;
use std::sync::Arc;

use parking_lot::Mutex;
use recording::Progress;
use ros::diagnostics::Status;

use crate::channel::Feed;
use crate::session::Ended;

/// What diagnostics shows; shared with the diagnostics' task.
#[derive(Clone, Default)]
pub(crate) struct Shown(Arc<Mutex<State>>);

#[derive(Default)]
enum State {
    #[default]
    Idle,
    Recording(PathBuf, Arc<Feed>),
    /// The last bag, until the next begins.
    Failed(String),
}

impl Shown {
    pub(crate) fn recording(&self, path: PathBuf, feed: Arc<Feed>) {
        *self.0.lock() = State::Recording(path, feed);
    }

    pub(crate) fn ended(&self, ended: &Ended) {
        *self.0.lock() = match &ended.failure {
            None => State::Idle,
            Some(_) => State::Failed(summary(ended)),
        };
    }

    pub(crate) fn status(&self) -> Status {
        match &*self.0.lock() {
            State::Idle => Status::ok("not recording"),
            State::Failed(summary) => Status::error(summary.clone()),
            State::Recording(path, feed) => recording_status(path, feed),
        }
    }
}

fn recording_status(path: &std::path::Path, feed: &Feed) -> Status {
    let progress = feed.inlet().progress();
    let lost = progress.dropped + progress.refused + feed.missed();
    let status = match feed.inlet().failure() {
        Some(failure) => Status::error(format!("the recording ended: {failure}")),
        None if lost > 0 => Status::warn(format!("recording {}; messages are lost", path.display())),
        None => Status::ok(format!("recording {}", path.display())),
    };
    status
        .value("messages", progress.written, "")
        .value("written", megabytes(progress.written_bytes), "MB")
        .value("file", megabytes(progress.file_bytes), "MB")
        .value("queue", megabytes(progress.queued_bytes as u64), "MB")
        .value("dropped, queue full", progress.dropped, "")
        .value("not serialisable", progress.refused, "")
        .value("missed before the queue", feed.missed(), "")
}

/// A finished bag in a sentence.
pub(crate) fn summary(ended: &Ended) -> String {
    let Ended {
        path,
        lasted,
        progress,
        missed,
        failure,
    } = ended;
    let (path, lasted) = (path.display(), lasted.as_secs_f64());
    let lost = lost(progress, *missed, failure.is_some());
    match failure {
        None => format!(
            "{path}: {} messages in {lasted:.1} s, {} MB, {} MB on disk{lost}",
            progress.written,
            megabytes(progress.written_bytes),
            megabytes(progress.file_bytes),
        ),
        Some(failure) => format!(
            "the recording ended after {lasted:.1} s: {failure}; {} messages are in {path}{lost}",
            progress.safe_messages,
        ),
    }
}

fn lost(progress: &Progress, missed: u64, failed: bool) -> String {
    let why_dropped = if failed {
        "dropped"
    } else {
        "dropped because the queue was full"
    };
    let counts = [
        (progress.dropped, why_dropped),
        (progress.refused, "not serialisable"),
        (missed, "missed before the queue"),
    ];
    let told = counts.into_iter().filter(|(count, _)| *count > 0);
    let parts: Vec<String> = told.map(|(count, what)| format!(", {count} {what}")).collect();
    parts.concat()
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / 1e6)
}
