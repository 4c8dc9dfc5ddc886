//! What the code under test logs in this process.

use std::fmt::Write as _;
use std::sync::{Mutex, OnceLock, PoisonError};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

use crate::waiting::eventually;

/// Every warning and error of this process since [`Logs::collect`], without the middleware's own.
///
/// Tests of one process share it: look for what only yours can say, such as its domain or topic.
pub struct Logs {
    records: Mutex<Vec<String>>,
}

static LOGS: OnceLock<Logs> = OnceLock::new();

impl Logs {
    /// Begins to collect, if that has not begun.
    pub fn collect() -> &'static Self {
        LOGS.get_or_init(|| {
            // Fails when a logger is installed already; then there is nothing to collect and the test says so.
            let _ = tracing_subscriber::registry().with(Collector).try_init();
            Self {
                records: Mutex::default(),
            }
        })
    }

    /// How many records hold all of `parts`.
    pub fn count(&self, parts: &[&str]) -> usize {
        let records = self.records.lock().unwrap_or_else(PoisonError::into_inner);
        records
            .iter()
            .filter(|record| parts.iter().all(|part| record.contains(part)))
            .count()
    }

    /// Waits for a record that holds all of `parts`.
    pub async fn wait_for(&self, parts: &[&str]) {
        eventually(&format!("a warning with {parts:?}"), || self.count(parts) > 0).await;
    }
}

struct Collector;

impl<S: Subscriber> Layer<S> for Collector {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let metadata = event.metadata();
        let middleware = ["rustdds", "ros2_client"]
            .iter()
            .any(|name| metadata.target().starts_with(name));
        if *metadata.level() > Level::WARN || middleware {
            return;
        }
        let mut text = Text(format!("{}: ", metadata.level()));
        event.record(&mut text);
        if let Some(logs) = LOGS.get() {
            logs.records.lock().unwrap_or_else(PoisonError::into_inner).push(text.0);
        }
    }
}

struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        // Writing into a String cannot fail.
        let _ = write!(self.0, "{}={value:?} ", field.name());
    }
}
