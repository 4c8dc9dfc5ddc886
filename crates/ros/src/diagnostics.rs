//! `/diagnostics`: how a node is, once a second.

use std::fmt::Display;
use std::sync::Arc;
use std::time::Duration;

use interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus, KeyValue};
use interfaces::std_msgs::msg::Header;
use parking_lot::Mutex;
use tokio::time::MissedTickBehavior;
use tokio_util::sync::CancellationToken;

use crate::clock::Clock;
use crate::publisher::Publisher;

const PERIOD: Duration = Duration::from_secs(1);

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// As it should be.
    Ok,
    /// Works, but somebody should look.
    Warn,
    /// Does not work.
    Error,
    /// Nothing has been heard for too long.
    Stale,
}

/// What a part of a node says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    level: Level,
    message: String,
    values: Vec<(String, String)>,
}

impl Status {
    /// A status with a sentence for people.
    pub fn new(level: Level, message: impl Into<String>) -> Self {
        Self {
            level,
            message: message.into(),
            values: Vec::new(),
        }
    }

    /// [`Level::Ok`].
    pub fn ok(message: impl Into<String>) -> Self {
        Self::new(Level::Ok, message)
    }

    /// [`Level::Warn`].
    pub fn warn(message: impl Into<String>) -> Self {
        Self::new(Level::Warn, message)
    }

    /// [`Level::Error`].
    pub fn error(message: impl Into<String>) -> Self {
        Self::new(Level::Error, message)
    }

    /// [`Level::Stale`].
    pub fn stale(message: impl Into<String>) -> Self {
        Self::new(Level::Stale, message)
    }

    /// Adds a value; the unit stands behind it ("31.5 degC"), or is empty.
    #[must_use]
    pub fn value(mut self, key: impl Into<String>, value: impl Display, unit: &str) -> Self {
        let value = if unit.is_empty() {
            value.to_string()
        } else {
            format!("{value} {unit}")
        };
        self.values.push((key.into(), value));
        self
    }
}

type Provider = Box<dyn FnMut() -> Status + Send>;

/// What a node reports. Clones are handles to the same list.
#[derive(Clone, Default)]
pub struct Diagnostics {
    parts: Arc<Mutex<Vec<Part>>>,
}

struct Part {
    name: String,
    hardware_id: String,
    provider: Provider,
}

impl Diagnostics {
    /// Adds a part of the node; a part of the same name gives way. `status` is asked once a second while somebody
    /// listens, and must neither block nor hold the node (a weak handle or a channel's end will do).
    pub fn register(
        &self,
        name: impl Into<String>,
        hardware_id: impl Into<String>,
        status: impl FnMut() -> Status + Send + 'static,
    ) {
        let part = Part {
            name: name.into(),
            hardware_id: hardware_id.into(),
            provider: Box::new(status),
        };
        let mut parts = self.parts.lock();
        parts.retain(|other| other.name != part.name);
        parts.push(part);
    }

    /// Takes a part off the report.
    pub fn unregister(&self, name: &str) {
        self.parts.lock().retain(|part| part.name != name);
    }

    /// Asks every part. As usual, a status is named "node: part".
    fn report(&self, node: &str) -> Vec<DiagnosticStatus> {
        let node = node.trim_start_matches('/');
        self.parts.lock().iter_mut().map(|part| part.report(node)).collect()
    }
}

impl Part {
    fn report(&mut self, node: &str) -> DiagnosticStatus {
        let status = (self.provider)();
        DiagnosticStatus {
            level: match status.level {
                Level::Ok => DiagnosticStatus::OK,
                Level::Warn => DiagnosticStatus::WARN,
                Level::Error => DiagnosticStatus::ERROR,
                Level::Stale => DiagnosticStatus::STALE,
            },
            name: format!("{node}: {}", self.name),
            message: status.message,
            hardware_id: self.hardware_id.clone(),
            values: status
                .values
                .into_iter()
                .map(|(key, value)| KeyValue { key, value })
                .collect(),
        }
    }
}

/// Publishes a report a second until `stop`, while somebody listens.
pub(crate) async fn publish(
    node: String,
    diagnostics: Diagnostics,
    clock: Clock,
    publisher: Publisher<DiagnosticArray>,
    stop: CancellationToken,
) {
    let mut ticks = tokio::time::interval(PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = stop.cancelled() => return,
            _ = ticks.tick() => {}
        }
        if publisher.subscription_count() == 0 {
            continue;
        }
        let header = Header {
            stamp: clock.now(),
            ..Header::default()
        };
        let report = DiagnosticArray {
            header,
            status: diagnostics.report(&node),
        };
        if let Err(error) = publisher.publish(report) {
            tracing::debug!(node, %error, "a diagnostic report is lost");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_names_node_part_and_units() {
        let diagnostics = Diagnostics::default();
        let mut asked = 0;
        diagnostics.register("camera", "serial 42", move || {
            asked += 1;
            Status::warn("warm")
                .value("temperature", 61.5, "degC")
                .value("asked", asked, "")
        });
        diagnostics.register("lights", "", || Status::ok("dark"));
        diagnostics.report("/cell/capture");
        let report = diagnostics.report("/cell/capture");
        assert_eq!(report[0].name, "cell/capture: camera");
        assert_eq!(
            (report[0].level, report[0].hardware_id.as_str()),
            (DiagnosticStatus::WARN, "serial 42")
        );
        let values: Vec<_> = report[0]
            .values
            .iter()
            .map(|v| (v.key.as_str(), v.value.as_str()))
            .collect();
        assert_eq!(values, [("temperature", "61.5 degC"), ("asked", "2")]);
        assert_eq!(
            (report[1].level, report[1].message.as_str()),
            (DiagnosticStatus::OK, "dark")
        );
    }

    #[test]
    fn a_part_can_be_replaced_and_taken_away() {
        let diagnostics = Diagnostics::default();
        diagnostics.register("camera", "", || Status::ok("first"));
        diagnostics.register("camera", "", || Status::stale("second"));
        let report = diagnostics.report("/a");
        assert_eq!(
            (report.len(), report[0].message.as_str(), report[0].level),
            (1, "second", DiagnosticStatus::STALE)
        );
        diagnostics.unregister("camera");
        assert!(diagnostics.report("/a").is_empty());
    }
}
