use core::ops::RangeInclusive;

use crate::fields::{FieldReader, FieldWriter};
use crate::frame::Frame;
use crate::{LightProtocolError, Panels, Triggers};

/// Most steps of a sequence.
pub const MAX_STEPS: usize = 16;
pub(crate) const STEP_BYTES: usize = 10;
pub(crate) const SEQUENCE_HEADER_BYTES: usize = 5;

const ON_MICROS: RangeInclusive<u32> = 200..=1_000_000;
const GAP_MICROS: RangeInclusive<u32> = 100..=1_000_000;
/// Two edges of one step are at least this far apart.
const MIN_EDGE_MICROS: u32 = 64;

/// What happens during one exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Step {
    /// Lit during the step; none for a dark image.
    pub panels: Panels,
    /// Cameras whose trigger line is pulsed.
    pub triggers: Triggers,
    /// From the panels' rising to their falling edge, microseconds, 200 to 1 000 000.
    pub on_micros: u32,
    /// From there to the next step, all panels off, microseconds, 100 to 1 000 000.
    pub gap_micros: u32,
}

/// The pulse on the trigger lines, in every step that triggers a camera. It ends at least 64 us before the step does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TriggerPulse {
    /// From the step's start to the rising edge, microseconds; 0, or at least 64.
    pub delay_micros: u16,
    /// Length of the pulse, microseconds, at least 64.
    pub width_micros: u16,
}

/// One to sixteen steps that the firmware accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sequence {
    pulse: TriggerPulse,
    steps: [Step; MAX_STEPS],
    count: usize,
}

impl Sequence {
    /// Checks every range that the firmware checks; only a panel's duty is known to the firmware alone.
    pub fn new(pulse: TriggerPulse, steps: &[Step]) -> Result<Self, LightProtocolError> {
        let count = steps.len();
        if !(1..=MAX_STEPS).contains(&count) {
            return Err(LightProtocolError::StepCount { count, most: MAX_STEPS });
        }
        for (index, step) in steps.iter().enumerate() {
            check_step(pulse, index, step)?;
        }
        let mut all = [Step::default(); MAX_STEPS];
        all[..count].copy_from_slice(steps);
        Ok(Self {
            pulse,
            steps: all,
            count,
        })
    }

    /// The steps, in order.
    pub fn steps(&self) -> &[Step] {
        &self.steps[..self.count]
    }

    /// The pulse on the trigger lines.
    pub fn pulse(&self) -> TriggerPulse {
        self.pulse
    }

    /// From the first step's start to the last step's end, microseconds.
    pub fn total_micros(&self) -> u32 {
        let all: u32 = self.steps().iter().map(|step| step.on_micros + step.gap_micros).sum();
        all - self.steps().last().map_or(0, |last| last.gap_micros)
    }

    pub(crate) fn frame(&self, kind: u8, sequence_number: u8) -> Frame {
        let header = FieldWriter::new()
            .u16(self.pulse.delay_micros)
            .u16(self.pulse.width_micros)
            .u8(self.count as u8);
        let fields = self.steps().iter().fold(header, |fields, step| {
            fields
                .u8(step.panels.bits())
                .u8(step.triggers.bits())
                .u32(step.on_micros)
                .u32(step.gap_micros)
        });
        fields.frame(kind, sequence_number)
    }

    pub(crate) fn from_frame(frame: &Frame) -> Result<Self, LightProtocolError> {
        let count = frame
            .payload()
            .get(SEQUENCE_HEADER_BYTES - 1)
            .map_or(0, |count| usize::from(*count));
        let mut fields = FieldReader::new(frame, SEQUENCE_HEADER_BYTES + count * STEP_BYTES)?;
        let pulse = TriggerPulse {
            delay_micros: fields.u16(),
            width_micros: fields.u16(),
        };
        fields.u8();
        let mut steps = [Step::default(); MAX_STEPS];
        // The payload's length, checked above, allows no more than sixteen.
        for step in &mut steps[..count] {
            *step = Step {
                panels: Panels::from_bits(fields.u8())?,
                triggers: Triggers::from_bits(fields.u8())?,
                on_micros: fields.u32(),
                gap_micros: fields.u32(),
            };
        }
        Self::new(pulse, &steps[..count])
    }
}

fn check_step(pulse: TriggerPulse, step: usize, values: &Step) -> Result<(), LightProtocolError> {
    let check = |what, micros, allowed: RangeInclusive<u32>| {
        if allowed.contains(&micros) {
            return Ok(());
        }
        Err(LightProtocolError::StepTime {
            step,
            what,
            micros,
            least: *allowed.start(),
            most: *allowed.end(),
        })
    };
    check("the on-time", values.on_micros, ON_MICROS)?;
    check("the gap", values.gap_micros, GAP_MICROS)?;
    if values.triggers == Triggers::NONE {
        return Ok(());
    }
    let latest_end = values.on_micros - MIN_EDGE_MICROS;
    let (delay, width) = (u32::from(pulse.delay_micros), u32::from(pulse.width_micros));
    if delay > 0 {
        check("the trigger's delay", delay, MIN_EDGE_MICROS..=latest_end)?;
    }
    check("the trigger's width", width, MIN_EDGE_MICROS..=latest_end)?;
    check("the trigger's end", delay + width, MIN_EDGE_MICROS..=latest_end)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    const PULSE: TriggerPulse = TriggerPulse {
        delay_micros: 300,
        width_micros: 500,
    };
    const STEP: Step = Step {
        panels: Panels::NONE,
        triggers: Triggers::BOTH,
        on_micros: 2500,
        gap_micros: 500,
    };

    #[test]
    fn the_total_leaves_out_the_last_gap() -> Result<(), LightProtocolError> {
        assert_eq!(Sequence::new(PULSE, &[STEP; 8])?.total_micros(), 8 * 3000 - 500);
        Ok(())
    }

    #[test]
    fn a_pulse_must_fit_into_its_step() {
        let short = Step { on_micros: 863, ..STEP };
        let error = Sequence::new(PULSE, &[STEP, short]).expect_err("the pulse ends too late");
        assert_eq!(
            error.to_string(),
            "the trigger's end of step 1 is 800 us, allowed are 64 to 799 us"
        );
        let without = Step {
            triggers: Triggers::NONE,
            ..short
        };
        assert!(Sequence::new(PULSE, &[STEP, without]).is_ok());
    }

    #[test]
    fn counts_and_times_are_checked() {
        assert!(Sequence::new(PULSE, &[]).is_err());
        assert!(Sequence::new(PULSE, &[STEP; 16]).is_ok() && Sequence::new(PULSE, &[STEP; 17]).is_err());
        for wrong in [
            Step {
                on_micros: 1_000_001,
                ..STEP
            },
            Step { on_micros: 199, ..STEP },
            Step { gap_micros: 99, ..STEP },
            Step {
                gap_micros: u32::MAX,
                ..STEP
            },
        ] {
            assert!(Sequence::new(PULSE, &[wrong]).is_err(), "{wrong:?}");
        }
    }
}
