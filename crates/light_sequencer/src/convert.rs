//! Between messages and what the driver takes.

use std::time::{Duration, Instant};

use devices::{Channel, LightError, LightSequence, LightStep, SequenceReport, TimedStep};
use interfaces::builtin_interfaces::msg::{Duration as DurationMessage, Time};
use interfaces::rakelight_msgs::msg::LightStep as StepMessage;
use interfaces::rakelight_msgs::srv::RunLightSequenceRequest;
use ros::Clock;

/// A moment on both clocks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ClockPair {
    instant: Instant,
    ros_nanos: i64,
}

impl ClockPair {
    pub(crate) fn now(clock: &Clock) -> Self {
        let before = Instant::now();
        let ros_nanos = clock.now_nanos();
        Self {
            instant: before + before.elapsed() / 2,
            ros_nanos,
        }
    }

    pub(crate) fn ros(&self, instant: Instant) -> Time {
        let ahead = instant.saturating_duration_since(self.instant).as_nanos() as i64;
        let behind = self.instant.saturating_duration_since(instant).as_nanos() as i64;
        let nanos = self.ros_nanos.saturating_add(ahead).saturating_sub(behind);
        // Stamps end in 2106 and begin with 1970; a simulated clock may be younger than the capture.
        Time::from_nanos(nanos).unwrap_or_default()
    }
}

pub(crate) fn sequence(
    request: &RunLightSequenceRequest,
    trigger_delay: f64,
    trigger_width: f64,
) -> Result<LightSequence, LightError> {
    let on_time = duration("on_time", request.on_time)?;
    let gap = duration("gap", request.gap)?;
    let step = |(index, number): (usize, &u8)| {
        let channel = Channel::new(*number).ok_or_else(|| LightError::Refused {
            reason: format!("channel of step {index} is {number}, allowed are 0 (dark) to 7 (L7)"),
        })?;
        Ok(LightStep { channel, on_time, gap })
    };
    Ok(LightSequence {
        steps: request
            .channels
            .iter()
            .enumerate()
            .map(step)
            .collect::<Result<_, LightError>>()?,
        // Within the parameters' ranges.
        trigger_delay: Duration::from_secs_f64(trigger_delay),
        trigger_width: Duration::from_secs_f64(trigger_width),
    })
}

pub(crate) fn duration(what: &str, message: DurationMessage) -> Result<Duration, LightError> {
    Duration::try_from(message).map_err(|_| LightError::Refused {
        reason: format!(
            "{what} is {} s and {} ns, allowed is nothing negative",
            message.sec, message.nanosec
        ),
    })
}

/// One for each step; all times by the same pair of clocks, so that differences between them stay exact.
pub(crate) fn steps(asked: &LightSequence, report: &SequenceReport, clocks: ClockPair) -> Vec<StepMessage> {
    let pairs = asked.steps.iter().zip(&report.steps);
    (0..)
        .zip(pairs)
        .map(|(index, (step, timed))| step_message(index, step.channel, timed, clocks))
        .collect()
}

fn step_message(index: u8, channel: Channel, timed: &TimedStep, clocks: ClockPair) -> StepMessage {
    StepMessage {
        index,
        channel: channel.number(),
        switched_at: clocks.ros(timed.on_at),
        triggered_at: clocks.ros(timed.triggered_at),
        ended_at: clocks.ros(timed.off_at),
    }
}

/// Durations of lights are far below the 68 years that the message holds.
pub(crate) fn duration_message(duration: Duration) -> DurationMessage {
    DurationMessage::try_from(duration).unwrap_or_default()
}

/// For the log.
pub(crate) fn channel_names(asked: &LightSequence) -> String {
    let names: Vec<String> = asked.steps.iter().map(|step| step.channel.to_string()).collect();
    names.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(channels: &[u8]) -> RunLightSequenceRequest {
        RunLightSequenceRequest {
            capture_id: "one".into(),
            channels: channels.to_vec().into(),
            on_time: duration_message(Duration::from_micros(2500)),
            gap: duration_message(Duration::from_micros(500)),
        }
    }

    #[test]
    fn a_request_keeps_its_order() {
        let sequence = sequence(&request(&[0, 7, 1]), 0.0003, 0.0005).expect("in range");
        assert_eq!(channel_names(&sequence), "dark L7 L1");
        assert_eq!(sequence.steps[2].on_time, Duration::from_micros(2500));
        assert_eq!(
            (sequence.trigger_delay, sequence.trigger_width),
            (Duration::from_micros(300), Duration::from_micros(500))
        );
    }

    #[test]
    fn what_is_no_channel_and_no_duration_is_refused() {
        let error = sequence(&request(&[0, 8]), 0.0, 0.001).expect_err("there are seven");
        assert_eq!(
            error.to_string(),
            "channel of step 1 is 8, allowed are 0 (dark) to 7 (L7)"
        );
        let mut negative = request(&[0]);
        negative.gap = DurationMessage { sec: -1, nanosec: 5 };
        let error = sequence(&negative, 0.0, 0.001).expect_err("negative");
        assert_eq!(error.to_string(), "gap is -1 s and 5 ns, allowed is nothing negative");
    }

    #[test]
    fn instants_keep_their_distances_on_the_ros_clock() {
        let before = Instant::now();
        let clocks = ClockPair::now(&Clock::new());
        let earlier = clocks.ros(before).to_nanos();
        let later = clocks.ros(before + Duration::from_millis(2)).to_nanos();
        assert_eq!(later - earlier, 2_000_000);
    }
}
