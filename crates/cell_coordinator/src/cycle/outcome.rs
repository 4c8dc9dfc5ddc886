//! What is told of a cycle, while it runs and at its end.

use interfaces::rakelight_msgs::msg::Grasp;

use super::check::Check;
use super::execute::{self, Step};
use super::order::Carried;
use super::stage::{Stage, Timing};
use super::{Cycle, State};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Succeeded,
    Failed,
    Cancelled,
}

/// How it ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) kind: Kind,
    /// Why not, or after a success what was missing or went wrong on the way; for people.
    pub(crate) reason: String,
    pub(crate) failed_stage: Option<Stage>,
    /// The last one; empty: none.
    pub(crate) capture_id: String,
    /// The one that was used last, or in a dry run would be used.
    pub(crate) grasp: Option<Grasp>,
    /// The arm went for an object.
    pub(crate) moved: bool,
    /// What may hang on the cup.
    pub(crate) carried: Option<Carried>,
}

/// How it is going.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct View {
    pub(crate) stage: Option<Stage>,
    pub(crate) detail: String,
    /// 0 to 1, of the try that runs.
    pub(crate) progress: f32,
    pub(crate) capture_id: String,
    pub(crate) timings: Vec<Timing>,
}

impl Cycle {
    pub(crate) fn view(&self) -> View {
        View {
            stage: self.timings.last(),
            detail: self.detail(),
            progress: self.progress(),
            capture_id: self.capture_id.clone(),
            timings: self.timings.all().to_vec(),
        }
    }

    /// What is under way, for people.
    pub(super) fn detail(&self) -> String {
        let attempt = match self.attempts {
            0 | 1 => String::new(),
            attempts => format!(", attempt {attempts} of {}", self.policy.attempts),
        };
        let what = match (&self.state, self.taken.is_some()) {
            (State::Homing, _) => "the way home before the capture",
            (State::Capture, false) => "the capture",
            (State::Capture, true) => "a capture to see whether the object is gone",
            (State::Solve, _) => "solving",
            (State::Plan, _) => "planning grasps",
            (State::Check(check), _) => checking(check),
            (State::Execute(step), _) => execute::text(*step),
            (State::Interrupting(_), _) => "ending what is under way",
            (State::Closing(_), _) => "switching the pump off",
            (State::Ended, _) => "the end",
        };
        format!("{what}{attempt}")
    }

    fn progress(&self) -> f32 {
        let verifies = self.taken.is_some();
        let tenths = match &self.state {
            State::Homing => 0.0,
            State::Capture if verifies => 8.0,
            State::Solve if verifies => 8.5,
            State::Plan if verifies => 9.5,
            State::Capture => 0.5,
            State::Solve => 1.0,
            State::Plan => 2.0,
            State::Check(_) => 2.5,
            State::Execute(step) => 3.0 + of_step(*step) * 0.7,
            State::Interrupting(_) | State::Closing(_) | State::Ended => 10.0,
        };
        tenths / 10.0
    }
}

fn checking(check: &Check) -> &'static str {
    if check.puts_down() {
        "a dry run of putting down what the cup holds"
    } else {
        "a dry run of the way"
    }
}

fn of_step(step: Step) -> f32 {
    match step {
        Step::PumpOn => 0.0,
        Step::Pregrasp => 1.0,
        Step::Approach => 2.0,
        Step::Lift => 3.0,
        Step::ToBin => 4.0,
        Step::PumpOff => 5.0,
        Step::Release => 6.0,
        Step::Home | Step::Abandon(_) => 7.0,
    }
}
