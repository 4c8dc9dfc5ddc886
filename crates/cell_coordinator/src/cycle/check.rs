//! The dry run of a whole way, before anything moves.

use std::time::Duration;

use interfaces::rakelight_msgs::msg::Grasp;

use super::candidates::{self, place};
use super::dialogue::{Command, DryRun, Event, Fault, Move};
use super::order::Carried;
use super::stage::Stage;
use super::way::{self, TURNS, TURNS_AT_OBJECT, Task};
use super::{Cycle, State};

/// A way that is being checked, leg by leg.
pub(super) struct Check {
    task: Task,
    leg: Leg,
    /// Where the leg begins; empty: where the arm stands.
    joints: Vec<f64>,
    /// As the planner gave it, and how often the tool is turned about its own axis.
    grasp: Option<(Grasp, u32)>,
    /// Which leg of the first way cannot be, and why.
    refusal: Option<(Leg, String)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leg {
    Pregrasp,
    Approach,
    Lift,
    /// With the tool turned so often.
    Bin(u32),
}

impl Leg {
    fn next(self) -> Option<Self> {
        match self {
            Self::Pregrasp => Some(Self::Approach),
            Self::Approach => Some(Self::Lift),
            Self::Lift => Some(Self::Bin(0)),
            Self::Bin(_) => None,
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::Pregrasp => "the way to it",
            Self::Approach => "the approach",
            Self::Lift => "the lift",
            Self::Bin(_) => "the way to the bin",
        }
    }
}

impl Check {
    pub(super) fn puts_down(&self) -> bool {
        self.task.reach.is_none()
    }
}

impl Cycle {
    /// The best grasp that is left, or the end.
    pub(super) fn check_next(&mut self) -> Option<Command> {
        let Some(grasp) = self.candidates.pop_front() else {
            return self.fail("none of the grasps can be executed");
        };
        self.check_turned(grasp, 0, None)
    }

    /// The same contact, with the tool turned so often.
    fn check_turned(&mut self, grasp: Grasp, turn: u32, refusal: Option<(Leg, String)>) -> Option<Command> {
        let task = Task::of(way::turned(grasp.clone(), turn), &self.policy);
        self.check_leg(Check {
            task,
            leg: Leg::Pregrasp,
            joints: Vec::new(),
            grasp: Some((grasp, turn)),
            refusal,
        })
    }

    /// What the cup holds goes into the bin first.
    pub(super) fn put_down(&mut self, carried: Carried) -> Option<Command> {
        self.enter(Stage::Execute);
        (self.pump, self.holds, self.seen_held) = (true, true, true);
        let Some(tool) = self.tool else {
            return self.fail("the cup holds an object, and where is not known");
        };
        self.check_leg(Check {
            task: Task::put_down(carried, &tool, &self.policy),
            leg: Leg::Lift,
            joints: Vec::new(),
            grasp: None,
            refusal: None,
        })
    }

    fn check_leg(&mut self, check: Check) -> Option<Command> {
        let Some(way) = self.way(&check) else {
            return self.fail("where the tool is is not known");
        };
        let start_joints = check.joints.clone();
        self.state = State::Check(Box::new(check));
        Some(Command::Move(Move {
            dry: Some(DryRun { start_joints }),
            ..way
        }))
    }

    fn way(&self, check: &Check) -> Option<Move> {
        let reach = check.task.reach.as_ref();
        match check.leg {
            Leg::Pregrasp => reach.map(|reach| reach.pregrasp.clone()),
            Leg::Approach => reach.map(|reach| reach.approach.clone()),
            Leg::Lift => check.task.lift.clone(),
            Leg::Bin(turn) => self
                .tool
                .as_ref()
                .map(|tool| way::over_bin(&self.policy.bin, check.task.carried, tool, turn)),
        }
    }

    pub(super) fn on_checked(&mut self, check: Check, answer: Event) -> Option<Command> {
        match answer {
            Event::Moved { duration, .. } if duration > self.policy.longest_leg => {
                self.on_impossible(check, too_long(duration, self.policy.longest_leg))
            }
            Event::Moved { joints, .. } => self.on_possible(check, joints),
            Event::Failed(Fault::Refused(reason)) => self.on_impossible(check, reason),
            other => self.fail(&super::seek::why(&other)),
        }
    }

    fn on_possible(&mut self, mut check: Check, joints: Vec<f64>) -> Option<Command> {
        if let Some(leg) = check.leg.next() {
            (check.leg, check.joints) = (leg, joints);
            return self.check_leg(check);
        }
        check.task.bin = self.way(&check);
        self.grasp = check.task.reach.as_ref().map(|reach| reach.grasp.clone());
        if self.order.dry_run {
            return self.succeed();
        }
        self.execute(check.task)
    }

    fn on_impossible(&mut self, mut check: Check, reason: String) -> Option<Command> {
        let first = check.refusal.take().unwrap_or((check.leg, reason));
        match check.leg {
            Leg::Bin(turn) if turn + 1 < TURNS => {
                (check.leg, check.refusal) = (Leg::Bin(turn + 1), Some(first));
                self.check_leg(check)
            }
            // It may be as high up as it can be.
            Leg::Lift if check.puts_down() => {
                check.task.lift = None;
                check.leg = Leg::Bin(0);
                self.check_leg(check)
            }
            leg => self.on_refused(leg, check.grasp, first),
        }
    }

    /// With the tool turned, with the next grasp, or not at all.
    fn on_refused(&mut self, leg: Leg, grasp: Option<(Grasp, u32)>, first: (Leg, String)) -> Option<Command> {
        match grasp {
            None => self.fail(&format!("what the cup holds cannot be put into the bin: {}", first.1)),
            Some((grasp, turn)) if turn + 1 < TURNS_AT_OBJECT && !matches!(leg, Leg::Bin(_)) => {
                self.check_turned(grasp, turn + 1, Some(first))
            }
            Some((grasp, _)) => {
                let (leg, reason) = first;
                self.troubles
                    .push(format!("grasp {}: {} is refused: {reason}", place(&grasp), leg.text()));
                self.failed.push(candidates::contact(&grasp));
                self.check_next()
            }
        }
    }
}

/// Near a singularity the joints have far to go while the tool goes nowhere.
fn too_long(duration: Duration, longest: Duration) -> String {
    format!(
        "it takes {:.1} s, allowed: up to {:.1} s (longest_leg)",
        duration.as_secs_f64(),
        longest.as_secs_f64()
    )
}
