//! Between what the cell says and what goes over the line.

use std::time::Duration;

use devices::{LightError, LightSequence, PANEL_COUNT, PanelSet};
use light_protocol::{Command, MAX_SET_MILLIS, Panels, Sequence, Step, TriggerPulse, Triggers};

pub(crate) fn refused(reason: &impl ToString) -> LightError {
    LightError::Refused {
        reason: reason.to_string(),
    }
}

pub(crate) fn panels(set: PanelSet) -> Panels {
    (1..=PANEL_COUNT as u8)
        .zip(set.0)
        .filter(|(_, on)| *on)
        .filter_map(|(number, _)| Panels::single(number).ok())
        .fold(Panels::NONE, Panels::with)
}

pub(crate) fn panel_set(panels: Panels) -> PanelSet {
    PanelSet(std::array::from_fn(|index| panels.contains(index as u8 + 1)))
}

/// A sequence that triggers both cameras in every step.
pub(crate) fn sequence(asked: &LightSequence) -> Result<Sequence, LightError> {
    let pulse = TriggerPulse {
        delay_micros: pulse_micros("the trigger's delay", asked.trigger_delay)?,
        width_micros: pulse_micros("the trigger's width", asked.trigger_width)?,
    };
    let steps: Vec<Step> = asked
        .steps
        .iter()
        .map(|step| Step {
            panels: panels(step.channel.panels()),
            triggers: Triggers::BOTH,
            on_micros: micros(step.on_time),
            gap_micros: micros(step.gap),
        })
        .collect();
    Sequence::new(pulse, &steps).map_err(|error| refused(&error))
}

/// What is too long for the field is too long for the firmware, too.
fn micros(duration: Duration) -> u32 {
    u32::try_from(duration.as_micros()).unwrap_or(u32::MAX)
}

fn pulse_micros(what: &str, duration: Duration) -> Result<u16, LightError> {
    u16::try_from(duration.as_micros()).map_err(|_| {
        refused(&format!(
            "{what} is {} us, allowed are 0 to {} us",
            duration.as_micros(),
            u16::MAX
        ))
    })
}

/// Panels that are set by hand.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ManualLight {
    pub(crate) panels: Panels,
    on_millis: u16,
}

impl ManualLight {
    pub(crate) fn command(self) -> Command {
        Command::Set {
            panels: self.panels,
            on_millis: self.on_millis,
        }
    }

    pub(crate) fn duration(self) -> Duration {
        Duration::from_millis(self.on_millis.into())
    }
}

/// A part of a millisecond is made a whole one.
pub(crate) fn set(panels: Panels, duration: Duration) -> Result<ManualLight, LightError> {
    let longest = Duration::from_millis(MAX_SET_MILLIS.into());
    if duration.is_zero() || duration > longest {
        return Err(refused(&format!(
            "the duration of panels set by hand is {} s, allowed is more than 0 and at most {} s",
            duration.as_secs_f64(),
            longest.as_secs()
        )));
    }
    let millis = duration.as_nanos().div_ceil(1_000_000) as u16;
    Ok(ManualLight {
        panels,
        on_millis: millis,
    })
}

#[cfg(test)]
mod tests {
    use devices::{Channel, LightStep};

    use super::*;

    fn capture(on_time: Duration) -> LightSequence {
        let steps = Channel::all().map(|channel| LightStep {
            channel,
            on_time,
            gap: Duration::from_micros(500),
        });
        LightSequence {
            steps: steps.collect(),
            trigger_delay: Duration::from_micros(300),
            trigger_width: Duration::from_micros(500),
        }
    }

    #[test]
    fn a_capture_keeps_its_order() {
        let sequence = sequence(&capture(Duration::from_micros(2500))).expect("in range");
        let lit: Vec<u8> = sequence.steps().iter().map(|step| step.panels.bits()).collect();
        assert_eq!(lit, [0, 1, 2, 4, 8, 16, 32, 64]);
        assert!(sequence.steps().iter().all(|step| step.triggers == Triggers::BOTH));
    }

    #[test]
    fn panels_survive_the_way_there_and_back() {
        for bits in 0..128 {
            let panels_before = Panels::from_bits(bits).expect("exists");
            assert_eq!(panels(panel_set(panels_before)), panels_before);
        }
    }

    #[test]
    fn what_is_out_of_range_is_refused_with_place_value_and_range() {
        let refusal = |asked: LightSequence| sequence(&asked).expect_err("refused").to_string();
        assert_eq!(
            refusal(capture(Duration::from_micros(150))),
            "the on-time of step 0 is 150 us, allowed are 200 to 1000000 us"
        );
        let mut late = capture(Duration::from_micros(2500));
        late.trigger_delay = Duration::from_secs(1);
        assert_eq!(
            refusal(late),
            "the trigger's delay is 1000000 us, allowed are 0 to 65535 us"
        );
        let mut empty = capture(Duration::from_micros(2500));
        empty.steps.clear();
        assert_eq!(refusal(empty), "a sequence of 0 steps, allowed are 1 to 16");
    }

    #[test]
    fn a_set_has_a_duration() {
        for wrong in [Duration::ZERO, Duration::from_secs(61)] {
            let text = set(Panels::ALL, wrong).expect_err("refused").to_string();
            assert!(text.ends_with("allowed is more than 0 and at most 60 s"), "{text}");
        }
        let short = set(Panels::ALL, Duration::from_micros(10)).expect("allowed");
        assert!(matches!(short.command(), Command::Set { on_millis: 1, .. }));
    }
}
