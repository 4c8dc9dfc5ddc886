//! A sequence under way: what was asked for against what the firmware reports.

use std::time::{Duration, Instant};

use devices::{LightError, SequenceReport, TimedStep};
use light_protocol::{BoardTime, EndReason, Ended, Sequence, Step, StepReport};

use crate::clock::BoardClock;
use crate::convert::panel_set;
use crate::job::Reply;

/// Beyond the sequence's own length: the way there, the reports, and a busy host.
const PATIENCE: Duration = Duration::from_secs(1);
/// A reported time may be so far from the asked one, microseconds. The firmware keeps to two.
const TOLERANCE_MICROS: u32 = 20;

pub(crate) struct SequenceRun {
    /// Of the SEQ.
    pub(crate) number: u8,
    pub(crate) deadline: Instant,
    asked: Sequence,
    reports: Vec<StepReport>,
    reply: Reply<SequenceReport>,
}

impl SequenceRun {
    pub(crate) fn new(number: u8, asked: Sequence, reply: Reply<SequenceReport>) -> Self {
        let length = Duration::from_micros(asked.total_micros().into());
        Self {
            number,
            deadline: Instant::now() + length + PATIENCE,
            asked,
            reports: Vec::new(),
            reply,
        }
    }

    /// Ends when nobody waits for the reply any more.
    pub(crate) async fn given_up(&mut self) {
        self.reply.closed().await;
    }

    pub(crate) fn is_given_up(&self) -> bool {
        self.reply.is_closed()
    }

    pub(crate) fn add(&mut self, report: StepReport) {
        self.reports.push(report);
    }

    /// The firmware refused it: nothing was lit.
    pub(crate) fn refuse(self, error: LightError) {
        // Whoever asked may have gone.
        let _ = self.reply.send(Err(error));
    }

    /// It did not run whole. Gives back what went wrong.
    pub(crate) fn fail(self, reason: impl Into<String>) -> LightError {
        let error = LightError::Incomplete {
            done: self.reports.len().min(self.asked.steps().len()),
            steps: self.asked.steps().len(),
            reason: reason.into(),
        };
        let _ = self.reply.send(Err(error.clone()));
        error
    }

    /// The firmware says that it is over. Gives back what was wrong with it, if anything.
    pub(crate) fn end(self, ended: Ended, clock: &BoardClock) -> Result<(), LightError> {
        let steps = match self.check(ended) {
            Ok(()) => self.timed_steps(clock),
            Err(reason) => return Err(self.fail(reason)),
        };
        let Some(steps) = steps else {
            return Err(self.fail("its times cannot be told: the controller's clock is not known yet"));
        };
        let report = SequenceReport {
            steps,
            clock_uncertainty: clock.uncertainty(),
        };
        let _ = self.reply.send(Ok(report));
        Ok(())
    }

    fn check(&self, ended: Ended) -> Result<(), String> {
        let steps = self.asked.steps();
        if ended.reason != EndReason::Complete {
            return Err(ended.reason.to_string());
        }
        if usize::from(ended.steps_done) != steps.len() {
            return Err(format!("the controller counted {} steps", ended.steps_done));
        }
        let arrived = |index: usize| self.reports.iter().any(|report| usize::from(report.index) == index);
        let missing: Vec<String> = (0..steps.len())
            .filter(|index| !arrived(*index))
            .map(|index| index.to_string())
            .collect();
        if !missing.is_empty() {
            return Err(format!("no report arrived of step {}", missing.join(", ")));
        }
        if self.reports.len() != steps.len() {
            return Err(format!("{} reports arrived", self.reports.len()));
        }
        let pairs = steps.iter().zip(&self.reports).enumerate();
        pairs
            .into_iter()
            .try_for_each(|(index, (step, report))| self.check_step(index, step, report))
    }

    fn check_step(&self, index: usize, step: &Step, report: &StepReport) -> Result<(), String> {
        if usize::from(report.index) != index || report.panels != step.panels || report.triggers != step.triggers {
            return Err(format!(
                "step {index} should light {}, reported was step {} with {} and triggers {}",
                step.panels,
                report.index,
                report.panels,
                report.triggers.bits()
            ));
        }
        let check = |what: &str, from: BoardTime, to: BoardTime, asked: u32| {
            let found = to.micros_since(from);
            if found.abs_diff(asked) <= TOLERANCE_MICROS {
                return Ok(());
            }
            Err(format!(
                "{what} of step {index} was {found} us, asked for were {asked} us"
            ))
        };
        check("the on-time", report.on_at, report.off_at, step.on_micros)?;
        if let Some(trigger_at) = report.trigger_at {
            let delay = self.asked.pulse().delay_micros.into();
            check("the trigger's delay", report.on_at, trigger_at, delay)?;
        }
        if let Some(next) = self.reports.get(index + 1) {
            check("the gap", report.off_at, next.on_at, step.gap_micros)?;
        }
        Ok(())
    }

    fn timed_steps(&self, clock: &BoardClock) -> Option<Vec<TimedStep>> {
        let timed = |report: &StepReport| {
            Some(TimedStep {
                panels: panel_set(report.panels),
                on_at: clock.instant(report.on_at)?,
                triggered_at: clock.instant(report.trigger_at.unwrap_or(report.on_at))?,
                off_at: clock.instant(report.off_at)?,
            })
        };
        self.reports.iter().map(timed).collect()
    }
}

#[cfg(test)]
mod tests {
    use light_protocol::{CommandKind, Panels, TriggerPulse, Triggers};
    use tokio::sync::oneshot;

    use super::*;

    const COUNT: usize = 4;

    fn asked() -> Sequence {
        let pulse = TriggerPulse {
            delay_micros: 300,
            width_micros: 500,
        };
        let step = |number| Step {
            panels: Panels::single(number).expect("exists"),
            triggers: Triggers::BOTH,
            on_micros: 2500,
            gap_micros: 500,
        };
        Sequence::new(pulse, &[1, 2, 3, 4].map(step)).expect("in range")
    }

    /// As the firmware would report them, a moment before its clock wraps.
    fn reports() -> Vec<StepReport> {
        let report = |(index, step): (usize, &Step)| {
            let start = (u32::MAX - 5000).wrapping_add(index as u32 * 3000);
            StepReport {
                index: index as u8,
                panels: step.panels,
                triggers: step.triggers,
                on_at: BoardTime(start),
                trigger_at: Some(BoardTime(start.wrapping_add(300))),
                off_at: BoardTime(start.wrapping_add(2501)),
            }
        };
        asked().steps().iter().enumerate().map(report).collect()
    }

    fn outcome(reports: Vec<StepReport>, reason: EndReason, steps_done: usize) -> String {
        let (reply, _answer) = oneshot::channel();
        let mut run = SequenceRun::new(1, asked(), reply);
        for report in reports {
            run.add(report);
        }
        let ended = Ended {
            command: CommandKind::Sequence,
            reason,
            steps_done: steps_done as u8,
            at: BoardTime(0),
        };
        run.check(ended).err().unwrap_or_else(|| "whole".into())
    }

    #[test]
    fn what_ran_as_asked_is_whole() {
        assert_eq!(outcome(reports(), EndReason::Complete, COUNT), "whole");
    }

    #[test]
    fn a_report_that_is_missing_or_too_many_is_noticed() {
        let mut missing = reports();
        missing.remove(2);
        assert_eq!(
            outcome(missing, EndReason::Complete, COUNT),
            "no report arrived of step 2"
        );
        let mut twice = reports();
        twice.push(twice[0]);
        assert_eq!(outcome(twice, EndReason::Complete, COUNT), "5 reports arrived");
        assert_eq!(
            outcome(reports(), EndReason::Complete, 3),
            "the controller counted 3 steps"
        );
    }

    #[test]
    fn reports_of_something_else_are_noticed() {
        let mut panels = reports();
        panels[1].panels = Panels::single(7).expect("exists");
        assert_eq!(
            outcome(panels, EndReason::Complete, COUNT),
            "step 1 should light L2, reported was step 1 with L7 and triggers 3"
        );
        let mut order = reports();
        order.swap(0, 1);
        assert!(outcome(order, EndReason::Complete, COUNT).starts_with("step 0 should light L1"));
        let mut long = reports();
        long[3].off_at = BoardTime(long[3].off_at.0.wrapping_add(30));
        assert_eq!(
            outcome(long, EndReason::Complete, COUNT),
            "the on-time of step 3 was 2531 us, asked for were 2500 us"
        );
        let mut late = reports();
        late[2].trigger_at = Some(late[2].off_at);
        assert!(outcome(late, EndReason::Complete, COUNT).starts_with("the trigger's delay of step 2 was 2501 us"));
    }

    #[test]
    fn an_early_end_says_why() {
        let some = reports()[..2].to_vec();
        assert_eq!(outcome(some.clone(), EndReason::Stopped, 2), "stopped by the host");
        assert!(outcome(some, EndReason::Silence, 2).contains("heard nothing from the host"));
    }
}
