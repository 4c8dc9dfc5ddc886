//! A bag of every cycle, when that is wanted.

use std::time::Duration;

use interfaces::builtin_interfaces::msg::Duration as DurationMessage;
use interfaces::rakelight_msgs::srv::{StartRecording, StartRecordingRequest};
use interfaces::std_srvs::srv::{Trigger, TriggerRequest};
use parking_lot::Mutex;
use ros::{Node, ServiceClient};

use crate::parameters::Parameters;
use crate::presence::{Presence, RECORDER};

/// For a bag to be made, or finished.
const PATIENCE: Duration = Duration::from_secs(30);
/// A bag whose cycle's node has died ends by itself, seconds.
const LONGEST: i32 = 1800;
/// Bags of earlier starts that are passed over.
const EARLIER: u32 = 10_000;

pub(crate) struct Recording {
    start: ServiceClient<StartRecording>,
    stop: ServiceClient<Trigger>,
    presence: Presence,
    /// Of the next bag.
    number: Mutex<u32>,
}

impl Recording {
    pub(crate) fn new(node: &Node, presence: Presence) -> Result<Self, ros::Error> {
        Ok(Self {
            start: node.service_client("record/start")?,
            stop: node.service_client("record/stop")?,
            presence,
            number: Mutex::new(1),
        })
    }

    /// Begins the next bag.
    pub(crate) async fn start(&self, parameters: &Parameters) -> Result<(), String> {
        let folder = parameters.record_folder.get();
        let first = *self.number.lock();
        for number in first..first + EARLIER {
            let request = StartRecordingRequest {
                path: path(&folder, number),
                results: true,
                topics: Vec::new(),
                max_duration: DurationMessage {
                    sec: LONGEST,
                    nanosec: 0,
                },
            };
            let answer = tokio::select! {
                answer = self.start.call(request, PATIENCE) => answer.map_err(|error| error.to_string())?,
                reason = self.presence.lost(RECORDER) => return Err(reason),
            };
            *self.number.lock() = number + 1;
            if answer.success {
                tracing::info!(path = answer.path, "the cycle is recorded");
                return Ok(());
            }
            if !answer.message.contains("exists already") {
                return Err(answer.message.clone());
            }
        }
        Err(format!("{EARLIER} bags from {} on exist already", path(&folder, first)))
    }

    /// Ends the bag.
    pub(crate) async fn stop(&self) -> Result<(), String> {
        let answer = tokio::select! {
            answer = self.stop.call(TriggerRequest::default(), PATIENCE) => answer.map_err(|error| error.to_string())?,
            reason = self.presence.lost(RECORDER) => return Err(reason),
        };
        if answer.success {
            return Ok(());
        }
        Err(answer.message.clone())
    }
}

fn path(folder: &str, number: u32) -> String {
    match folder.trim_end_matches('/') {
        "" => format!("cycle_{number}"),
        folder => format!("{folder}/cycle_{number}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bags_are_numbered_below_their_folder() {
        assert_eq!(path("", 3), "cycle_3");
        assert_eq!(path("/data/picks/", 12), "/data/picks/cycle_12");
    }
}
