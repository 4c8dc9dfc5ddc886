//! Looking: capture, solve, plan. Before a grasp it is for an object, after one for whether it is gone.

use super::candidates::{self, worth_trying};
use super::dialogue::{Command, Event, Fault, Planned};
use super::order::Mode;
use super::stage::Stage;
use super::{Cycle, State};

impl Cycle {
    /// Looks for something to pick.
    pub(super) fn look(&mut self) -> Command {
        self.taken = None;
        self.mode = 0;
        self.nothing.clear();
        self.capture()
    }

    /// A new capture, for either purpose.
    pub(super) fn capture(&mut self) -> Command {
        self.enter(Stage::Capture);
        self.state = State::Capture;
        Command::Capture {
            cameras: self.cameras.clone(),
        }
    }

    pub(super) fn on_home(&mut self, answer: Event) -> Option<Command> {
        match answer {
            Event::Done => Some(self.look()),
            other => self.fail(&format!("the arm did not go home: {}", why(&other))),
        }
    }

    pub(super) fn on_captured(&mut self, answer: Event) -> Option<Command> {
        match answer {
            Event::Captured { capture_id } => {
                self.capture_id = capture_id;
                Some(self.solve())
            }
            Event::Failed(Fault::Refused(reason)) => self.capture_without(&reason),
            other => self.fail(&why(&other)),
        }
    }

    /// Goes on with the cameras that `reason` does not name, if there are some of both.
    fn capture_without(&mut self, reason: &str) -> Option<Command> {
        let is_named = |camera: &&String| candidates::names(reason, camera);
        let (gone, left): (Vec<&String>, Vec<&String>) = self.cameras.iter().partition(is_named);
        if gone.is_empty() || left.is_empty() {
            return self.fail(reason);
        }
        let name = gone.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(", ");
        let left: Vec<String> = left.into_iter().cloned().collect();
        self.troubles.push(format!("without {name}: {reason}"));
        self.cameras.clone_from(&left);
        self.state = State::Capture;
        Some(Command::Capture { cameras: left })
    }

    fn solve(&mut self) -> Command {
        self.enter(Stage::Solve);
        self.state = State::Solve;
        Command::Solve {
            capture_id: self.capture_id.clone(),
        }
    }

    pub(super) fn on_solved(&mut self, answer: Event) -> Option<Command> {
        match answer {
            Event::Solved { cameras, message } => {
                let is_unexplained =
                    |camera: &&String| !cameras.contains(camera) && !candidates::names(&message, camera);
                let unsolved: Vec<&str> = self.cameras.iter().filter(is_unexplained).map(String::as_str).collect();
                if !unsolved.is_empty() {
                    let text = format!("{} was not solved", unsolved.join(", "));
                    self.note(text);
                }
                if !message.is_empty() {
                    self.note(message);
                }
                self.enter(Stage::Plan);
                Some(self.plan())
            }
            other => self.fail(&why(&other)),
        }
    }

    fn plan(&mut self) -> Command {
        self.state = State::Plan;
        Command::Plan {
            capture_id: self.capture_id.clone(),
            mode: self.order.modes[self.mode],
        }
    }

    pub(super) fn on_planned(&mut self, answer: Event) -> Option<Command> {
        match (answer, self.taken) {
            (Event::Planned(planned), None) => self.choose(planned),
            (Event::Planned(planned), Some(taken)) => self.verify(planned, &taken),
            (other, _) => self.fail(&why(&other)),
        }
    }

    fn choose(&mut self, planned: Planned) -> Option<Command> {
        let found = planned.grasps.len();
        let worth = worth_trying(planned.grasps, &self.failed);
        if worth.is_empty() {
            return self.nothing_in_this_mode(planned.message, found);
        }
        if !planned.message.is_empty() {
            self.note(planned.message);
        }
        self.candidates = worth.into();
        self.check_next()
    }

    fn nothing_in_this_mode(&mut self, message: String, found: usize) -> Option<Command> {
        let reason = match (message.is_empty(), found) {
            (false, _) => message,
            (true, 0) => "no grasp was found".to_owned(),
            (true, _) => "only grasps are left that have failed".to_owned(),
        };
        self.nothing
            .push(match (self.order.modes.len(), self.order.modes[self.mode]) {
                (1, _) => reason,
                (_, Mode::Solid) => format!("as a solid object: {reason}"),
                (_, Mode::Thin) => format!("as a thin one: {reason}"),
            });
        if self.mode + 1 < self.order.modes.len() {
            self.mode += 1;
            return Some(self.plan());
        }
        let reason = format!("nothing to pick: {}", self.nothing.join("; "));
        self.fail(&reason)
    }

    /// Whether the object is gone from where it was taken.
    fn verify(&mut self, planned: Planned, taken: &geometry::nalgebra::Point3<f64>) -> Option<Command> {
        if !planned.looked {
            return self.fail(&planned.message);
        }
        if !candidates::is_still_there(&planned.grasps, taken) {
            return self.succeed();
        }
        self.troubles.push(format!(
            "the object is still where it was taken, at ({:.3}, {:.3}, {:.3}) m",
            taken.x, taken.y, taken.z
        ));
        self.failed.push(*taken);
        self.taken = None;
        if self.attempts >= self.policy.attempts {
            return self.again();
        }
        // What was just seen is as good as a new capture.
        self.nothing.clear();
        self.choose(planned)
    }

    /// What was missing, once.
    fn note(&mut self, text: String) {
        if !self.troubles.contains(&text) {
            self.troubles.push(text);
        }
    }
}

/// For people.
pub(super) fn why(event: &Event) -> String {
    match event {
        Event::Failed(fault) => fault.reason().to_owned(),
        other => format!("an answer that makes no sense here: {other:?}"),
    }
}
