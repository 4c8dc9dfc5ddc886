//! How a cycle ends: what runs is ended first, then the pump is switched off unless something hangs on the cup.

use std::time::Duration;

use super::dialogue::{Command, Cup, Event, Fault};
use super::execute::Step;
use super::outcome::{Kind, Outcome};
use super::{Cycle, State};

/// Why it ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Ending {
    kind: Kind,
    reason: String,
}

/// What comes when that which runs has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Next {
    /// The object is no longer on the cup.
    Dropped,
    End(Ending),
}

impl Cycle {
    pub(super) fn succeed(&mut self) -> Option<Command> {
        self.close(Ending {
            kind: Kind::Succeeded,
            reason: String::new(),
        })
    }

    /// While nothing runs.
    pub(super) fn fail(&mut self, reason: &str) -> Option<Command> {
        self.close(Ending {
            kind: Kind::Failed,
            reason: reason.to_owned(),
        })
    }

    /// Whatever runs.
    pub(super) fn abort(&mut self, kind: Kind, reason: &str) -> Option<Command> {
        let reason = format!("{reason} ({})", self.detail());
        let ending = Ending { kind, reason };
        match &mut self.state {
            State::Ended | State::Closing(_) | State::Interrupting(Next::End(_)) => None,
            State::Interrupting(next) => {
                *next = Next::End(ending);
                None
            }
            State::Execute(Step::Release) => self.close(ending),
            _ => Some(self.interrupt(Next::End(ending))),
        }
    }

    pub(super) fn interrupt(&mut self, next: Next) -> Command {
        self.state = State::Interrupting(next);
        self.step_deadline = Some(self.now + self.policy.limits.interrupt);
        Command::Interrupt
    }

    pub(super) fn on_interrupted(&mut self, next: Next, answer: &Event) -> Option<Command> {
        self.step_deadline = None;
        if let Event::Moved { held: true, .. } = answer {
            self.holds = true;
        }
        match (next, answer) {
            (Next::End(ending), _) => self.close(ending),
            (Next::Dropped, Event::Failed(Fault::Lost(reason))) => self.fail(&format!(
                "the object was dropped on the way, and the arm's motion cannot be ended: {reason}"
            )),
            (Next::Dropped, _) => self.on_dropped(),
        }
    }

    fn close(&mut self, ending: Ending) -> Option<Command> {
        if !self.pump || self.is_holding() || self.order.dry_run {
            return self.finish(ending);
        }
        self.pump = false;
        self.state = State::Closing(ending);
        self.step_deadline = Some(self.now + self.policy.limits.interrupt);
        Some(Command::Vacuum { on: false })
    }

    pub(super) fn on_closed(&mut self, ending: Ending, answer: Event) -> Option<Command> {
        match answer {
            Event::Failed(fault) => {
                self.troubles
                    .push(format!("the pump was not switched off: {}", fault.reason()));
                self.finish(ending)
            }
            _ => self.finish(ending),
        }
    }

    pub(super) fn on_deadline(&mut self) -> Option<Command> {
        match std::mem::replace(&mut self.state, State::Ended) {
            State::Interrupting(next) => {
                let ending = match next {
                    Next::End(ending) => ending,
                    Next::Dropped => Ending {
                        kind: Kind::Failed,
                        reason: "the object was dropped on the way".into(),
                    },
                };
                let waited = seconds(self.policy.limits.interrupt);
                self.troubles.push(format!(
                    "what was under way did not end within {waited}; the arm was told to stop"
                ));
                self.finish(ending);
                Some(Command::Halt)
            }
            State::Closing(ending) => {
                let waited = seconds(self.policy.limits.interrupt);
                self.troubles.push(format!("the pump did not go off within {waited}"));
                self.finish(ending)
            }
            state @ State::Execute(Step::Release) => {
                self.state = state;
                self.not_released()
            }
            state => {
                self.state = state;
                self.too_long()
            }
        }
    }

    fn too_long(&mut self) -> Option<Command> {
        let Some(stage) = self.timings.last() else {
            return self.abort(Kind::Failed, "it takes too long");
        };
        let limit = seconds(self.policy.limits.of(stage));
        self.abort(
            Kind::Failed,
            &format!("stage {stage} takes longer than {limit} (timeouts.{stage})"),
        )
    }

    fn is_holding(&self) -> bool {
        self.holds || self.cup == Cup::Held
    }

    fn finish(&mut self, ending: Ending) -> Option<Command> {
        let succeeded = ending.kind == Kind::Succeeded;
        self.timings.close(succeeded, self.now);
        self.state = State::Ended;
        self.step_deadline = None;
        self.outcome = Some(Outcome {
            kind: ending.kind,
            reason: self.reason(ending.reason),
            failed_stage: self.timings.last().filter(|_| !succeeded),
            capture_id: self.capture_id.clone(),
            grasp: self.grasp.clone(),
            moved: self.attempts > 0,
            carried: self.task.as_ref().map(|task| task.carried),
        });
        None
    }

    /// What went wrong on the way, why it ended, and what is to be known next.
    fn reason(&mut self, last: String) -> String {
        let mut parts = std::mem::take(&mut self.troubles);
        if self.taken.is_some() && !last.is_empty() {
            parts.push(format!(
                "the object was released over the bin, but whether it is gone is not known: {last}"
            ));
        } else if !last.is_empty() {
            parts.push(last);
        }
        if self.is_holding() && self.pump && !self.order.dry_run {
            parts.push("the cup still holds an object, which the next `pick` puts into the bin first".into());
        }
        parts.join("; ")
    }
}

fn seconds(duration: Duration) -> String {
    format!("{:.1} s", duration.as_secs_f64())
}
