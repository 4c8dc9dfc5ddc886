//! Taking the object and putting it into the bin.

use interfaces::rakelight_msgs::msg::Grasp;

use super::candidates::{self, place};
use super::dialogue::{Command, Cup, Event, Fault};
use super::ending::Next;
use super::seek::why;
use super::stage::Stage;
use super::way::Task;
use super::{Cycle, Kind, State};

/// What is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    PumpOn,
    Pregrasp,
    Approach,
    Lift,
    ToBin,
    PumpOff,
    /// The pump is off; nothing runs until the cup holds nothing.
    Release,
    Home,
    /// The same, after something failed.
    Abandon(Abandon),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Abandon {
    PumpOff { was_near: bool },
    Back,
    Home,
}

impl Cycle {
    pub(super) fn execute(&mut self, task: Task) -> Option<Command> {
        let first = match (&task.reach, &task.lift) {
            (Some(_), _) => {
                self.enter(Stage::Execute);
                self.attempts += 1;
                Step::PumpOn
            }
            (None, Some(_)) => Step::Lift,
            (None, None) => Step::ToBin,
        };
        self.task = Some(task);
        self.step(first)
    }

    /// Begins a step.
    pub(super) fn step(&mut self, step: Step) -> Option<Command> {
        let task = self.task.as_ref();
        let reach = task.and_then(|task| task.reach.as_ref());
        self.step_deadline = None;
        let command = match step {
            Step::PumpOn => Some(Command::Vacuum { on: true }),
            Step::Pregrasp => reach.map(|reach| Command::Move(reach.pregrasp.clone())),
            Step::Approach => reach.map(|reach| Command::Move(reach.approach.clone())),
            Step::Abandon(Abandon::Back) => reach.map(|reach| Command::Move(reach.back.clone())),
            Step::Lift => task.and_then(|task| task.lift.clone()).map(Command::Move),
            Step::ToBin => task.and_then(|task| task.bin.clone()).map(Command::Move),
            Step::PumpOff | Step::Abandon(Abandon::PumpOff { .. }) => Some(Command::Vacuum { on: false }),
            Step::Home | Step::Abandon(Abandon::Home) => Some(Command::Home),
            Step::Release => {
                self.step_deadline = Some(self.now + self.policy.limits.release);
                None
            }
        };
        if let Some(Command::Vacuum { on }) = command {
            self.pump = on;
        }
        self.state = State::Execute(step);
        if step == Step::Release && self.cup != Cup::Held {
            return self.released();
        }
        command
    }

    pub(super) fn on_step(&mut self, step: Step, answer: Event) -> Option<Command> {
        match (step, answer) {
            (Step::Abandon(abandon), answer) => self.on_abandoned(abandon, &answer),
            (Step::PumpOn, Event::Done) => self.step(Step::Pregrasp),
            (Step::Pregrasp, Event::Moved { .. }) => self.step(Step::Approach),
            (Step::Approach, Event::Moved { held, .. }) if held || self.cup == Cup::Held => {
                (self.holds, self.seen_held) = (true, self.cup == Cup::Held);
                self.step(Step::Lift)
            }
            (Step::Approach, Event::Moved { .. }) => {
                self.give_up("the cup did not seal", Abandon::PumpOff { was_near: true })
            }
            (Step::Lift, Event::Moved { .. }) => self.carried(Step::ToBin),
            (Step::ToBin, Event::Moved { .. }) => self.carried(Step::PumpOff),
            (Step::PumpOff, Event::Done) => self.step(Step::Release),
            (Step::Home, Event::Done) => self.placed(),
            (step, Event::Failed(fault)) => self.on_failed_step(step, &fault),
            (_, other) => self.fail(&why(&other)),
        }
    }

    /// The cup has to hold something all the way.
    fn carried(&mut self, next: Step) -> Option<Command> {
        if self.cup == Cup::Held {
            self.seen_held = true;
            return self.step(next);
        }
        self.dropped()
    }

    fn dropped(&mut self) -> Option<Command> {
        self.holds = false;
        self.give_up(
            "the object was dropped on the way",
            Abandon::PumpOff { was_near: false },
        )
    }

    fn on_failed_step(&mut self, step: Step, fault: &Fault) -> Option<Command> {
        let reason = fault.reason();
        match (step, fault) {
            (Step::Pregrasp, Fault::Refused(_)) => {
                let trouble = format!("the way to it failed: {reason}");
                self.put_off(&trouble, Abandon::PumpOff { was_near: false })
            }
            (Step::Approach, Fault::Refused(_)) if self.cup != Cup::Held => {
                let trouble = format!("the approach failed: {reason}");
                self.put_off(&trouble, Abandon::PumpOff { was_near: true })
            }
            (Step::Lift | Step::ToBin, Fault::Refused(_)) if self.seen_held && self.cup != Cup::Held => self.dropped(),
            (Step::PumpOn | Step::PumpOff, _) => self.fail(&format!("the pump was not switched: {reason}")),
            (Step::Home, _) => self.fail(&format!(
                "the object was released over the bin, but the arm did not go home: {reason}"
            )),
            _ => self.fail(&format!("{} failed: {reason}", text(step))),
        }
    }

    /// A way that was found free did not go to its end. That says little of the grasp, which may be tried once more.
    fn put_off(&mut self, trouble: &str, first: Abandon) -> Option<Command> {
        let contact = self.grasp_under_way().map(candidates::contact);
        match contact {
            Some(contact) if !candidates::is_among(&contact, &self.put_off) => {
                self.put_off.push(contact);
                self.abandon(trouble, first)
            }
            _ => self.give_up(trouble, first),
        }
    }

    /// This grasp is done with; the arm gets out of the way.
    pub(super) fn give_up(&mut self, trouble: &str, first: Abandon) -> Option<Command> {
        let contact = self.grasp_under_way().map(candidates::contact);
        self.failed.extend(contact);
        self.abandon(trouble, first)
    }

    fn abandon(&mut self, trouble: &str, first: Abandon) -> Option<Command> {
        let trouble = match self.grasp_under_way() {
            Some(grasp) => format!("grasp {}: {trouble}", place(grasp)),
            None => trouble.to_owned(),
        };
        self.troubles.push(trouble);
        self.step(Step::Abandon(first))
    }

    fn grasp_under_way(&self) -> Option<&Grasp> {
        let reach = self.task.as_ref().and_then(|task| task.reach.as_ref());
        reach.map(|reach| &reach.grasp)
    }

    fn on_abandoned(&mut self, abandon: Abandon, answer: &Event) -> Option<Command> {
        match (abandon, answer) {
            (Abandon::PumpOff { was_near: true }, Event::Done) => self.step(Step::Abandon(Abandon::Back)),
            (Abandon::PumpOff { was_near: false }, Event::Done)
            // The way home is planned from anywhere.
            | (Abandon::Back, Event::Moved { .. } | Event::Failed(Fault::Refused(_))) => {
                self.step(Step::Abandon(Abandon::Home))
            }
            (Abandon::Home, Event::Done) => {
                self.timings.close(false, self.now);
                self.again()
            }
            (_, other) => self.fail(&format!("{} failed: {}", text(Step::Abandon(abandon)), why(other))),
        }
    }

    /// Something was heard of the cup.
    pub(super) fn on_cup(&mut self) -> Option<Command> {
        match &self.state {
            State::Execute(Step::Release) if self.cup != Cup::Held => self.released(),
            State::Execute(Step::Lift | Step::ToBin) if self.cup == Cup::Held => {
                self.seen_held = true;
                None
            }
            State::Execute(Step::Lift | Step::ToBin) if self.seen_held => {
                self.holds = false;
                Some(self.interrupt(Next::Dropped))
            }
            _ => None,
        }
    }

    /// After the motion with the lost object has ended.
    pub(super) fn on_dropped(&mut self) -> Option<Command> {
        self.dropped()
    }

    fn released(&mut self) -> Option<Command> {
        self.holds = false;
        self.step(Step::Home)
    }

    /// The arm is home again, and the object in the bin as far as is known.
    fn placed(&mut self) -> Option<Command> {
        let task = self.task.take();
        let Some(reach) = task.and_then(|task| task.reach) else {
            self.troubles
                .push("what the cup held before was put into the bin first".into());
            return Some(self.look());
        };
        if !self.policy.verify {
            return self.succeed();
        }
        self.taken = Some(candidates::contact(&reach.grasp));
        Some(self.capture())
    }

    pub(super) fn not_released(&mut self) -> Option<Command> {
        let reason = format!(
            "the cup still holds something {:.1} s after the pump was switched off (release_timeout)",
            self.policy.limits.release.as_secs_f64()
        );
        self.abort(Kind::Failed, &reason)
    }
}

/// For people.
pub(super) fn text(step: Step) -> &'static str {
    match step {
        Step::PumpOn => "switching the pump on",
        Step::Pregrasp => "the way to the object",
        Step::Approach => "the approach",
        Step::Lift => "the lift",
        Step::ToBin => "the way to the bin",
        Step::PumpOff => "switching the pump off",
        Step::Release => "the release",
        Step::Home => "the way home",
        Step::Abandon(Abandon::PumpOff { .. }) => "switching the pump off after a failed grasp",
        Step::Abandon(Abandon::Back) => "the way back from the object",
        Step::Abandon(Abandon::Home) => "the way home after a failed grasp",
    }
}
