//! One pick cycle as a state machine. It knows no ROS and no clock: it is told what happened and when, and says what is to
//! be done next, one thing at a time.
//!
//! ```text
//! [put down] -> [home] -> capture -> solve -> plan -> check -> execute -> capture -> solve -> plan -> done
//!                            ^                          |         |                              |
//!                            +--------------------------+---------+----- the next try -----------+
//! ```
//!
//! `check` runs the whole way to the bin as a dry run before anything moves; a grasp that is refused there gives way to the
//! next best. Once the arm has been at the object, what was seen before counts no more: the next try begins with a new
//! capture, and contacts that failed are not tried again; one whose way was cut short is, once. The last three stages
//! look whether the object is gone.

mod candidates;
mod check;
mod dialogue;
mod ending;
mod execute;
mod order;
mod outcome;
mod seek;
mod stage;
#[cfg(test)]
mod tests;
mod way;

use std::time::Duration;

use geometry::nalgebra::Point3;
use interfaces::rakelight_msgs::msg::Grasp;

#[cfg(test)]
pub(crate) use dialogue::DryRun;
pub(crate) use dialogue::{ArmReport, Command, Cup, Event, Fault, Move, Planned};
pub(crate) use order::{Bin, Carried, Limits, Mode, Order, Policy};
pub(crate) use outcome::{Kind, Outcome, View};
pub(crate) use stage::{Stage, Timing};

use check::Check;
use ending::{Ending, Next};
use execute::Step;
use stage::Timings;
use way::Task;

/// A cycle under way.
pub(crate) struct Cycle {
    order: Order,
    policy: Policy,
    state: State,
    now: Duration,
    /// Of the stage, and of the step if it has its own.
    stage_deadline: Duration,
    step_deadline: Option<Duration>,
    timings: Timings,
    cup: Cup,
    tool: Option<geometry::RigidTransform>,
    /// As it was asked for last.
    pump: bool,
    /// The object hangs on the cup, as far as is known.
    holds: bool,
    /// The cup was heard to hold it, so that hearing otherwise means a loss.
    seen_held: bool,
    /// Those that are still used.
    cameras: Vec<String>,
    capture_id: String,
    /// That it was put over the bin: the cycle looks whether it is gone from there.
    taken: Option<Point3<f64>>,
    mode: usize,
    attempts: u32,
    /// Best first.
    candidates: std::collections::VecDeque<Grasp>,
    /// Contacts that are not tried again.
    failed: Vec<Point3<f64>>,
    /// Contacts that the arm did not come to, once each.
    put_off: Vec<Point3<f64>>,
    /// What went wrong on the way, for people.
    troubles: Vec<String>,
    /// Why no mode gave a grasp.
    nothing: Vec<String>,
    task: Option<Task>,
    /// The grasp that is used, or was used last.
    grasp: Option<Grasp>,
    outcome: Option<Outcome>,
}

/// What is waited for.
enum State {
    /// The arm goes to where captures are taken from.
    Homing,
    Capture,
    Solve,
    Plan,
    Check(Box<Check>),
    Execute(Step),
    /// What runs was told to end.
    Interrupting(Next),
    /// The pump is switched off, then it ends.
    Closing(Ending),
    Ended,
}

impl Cycle {
    /// Begins at time zero.
    pub(crate) fn begin(order: Order, policy: Policy, arm: &ArmReport) -> (Self, Option<Command>) {
        let mut cycle = Self {
            state: State::Ended,
            now: Duration::ZERO,
            stage_deadline: Duration::ZERO,
            step_deadline: None,
            timings: Timings::default(),
            cup: arm.cup,
            tool: arm.tcp,
            pump: arm.cup != Cup::Off,
            holds: false,
            seen_held: false,
            cameras: order.cameras.clone(),
            capture_id: String::new(),
            taken: None,
            mode: 0,
            attempts: 0,
            candidates: std::collections::VecDeque::new(),
            failed: Vec::new(),
            put_off: Vec::new(),
            troubles: Vec::new(),
            nothing: Vec::new(),
            task: None,
            grasp: None,
            outcome: None,
            order,
            policy,
        };
        let first = cycle.start();
        (cycle, first)
    }

    fn start(&mut self) -> Option<Command> {
        match (self.order.held, self.order.at_home) {
            (Some(carried), _) if !self.order.dry_run => self.put_down(carried),
            (_, true) => Some(self.look()),
            (_, false) if self.order.dry_run => {
                self.enter(Stage::Capture);
                self.fail("the arm is not at home, where captures are taken from; the service `home` takes it there")
            }
            _ => {
                self.enter(Stage::Execute);
                self.state = State::Homing;
                Some(Command::Home)
            }
        }
    }

    /// What is to be done after `event`; `now` is the time since the begin.
    pub(crate) fn on(&mut self, event: Event, now: Duration) -> Option<Command> {
        self.now = now.max(self.now);
        if self.outcome.is_some() {
            return None;
        }
        match event {
            Event::Arm(report) => self.on_arm(report),
            Event::Cancel => self.abort(Kind::Cancelled, "cancelled"),
            Event::Tick if self.now >= self.deadline() => self.on_deadline(),
            Event::Tick => None,
            answer => self.on_answer(answer),
        }
    }

    fn on_answer(&mut self, answer: Event) -> Option<Command> {
        match std::mem::replace(&mut self.state, State::Ended) {
            State::Homing => self.on_home(answer),
            State::Capture => self.on_captured(answer),
            State::Solve => self.on_solved(answer),
            State::Plan => self.on_planned(answer),
            State::Check(check) => self.on_checked(*check, answer),
            State::Execute(step) => self.on_step(step, answer),
            State::Interrupting(next) => self.on_interrupted(next, &answer),
            State::Closing(ending) => self.on_closed(ending, answer),
            State::Ended => None,
        }
    }

    fn on_arm(&mut self, report: ArmReport) -> Option<Command> {
        self.cup = report.cup;
        self.tool = report.tcp.or(self.tool.take());
        if let Some(reason) = report.unfit.filter(|_| !self.order.dry_run) {
            return self.abort(Kind::Failed, &reason);
        }
        self.on_cup()
    }

    /// When [`Event::Tick`] is wanted.
    pub(crate) fn deadline(&self) -> Duration {
        self.step_deadline.unwrap_or(self.stage_deadline)
    }

    /// Once it has ended.
    pub(crate) fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    /// Begins a stage.
    fn enter(&mut self, stage: Stage) {
        self.timings.open(stage, self.now);
        self.stage_deadline = self.now + self.policy.limits.of(stage);
        self.step_deadline = None;
    }

    /// The next try, after the arm has been at the object, or the end if there were enough.
    fn again(&mut self) -> Option<Command> {
        if self.attempts < self.policy.attempts {
            return Some(self.look());
        }
        let reason = match self.attempts {
            1 => "gave up after 1 attempt".to_owned(),
            attempts => format!("gave up after {attempts} attempts"),
        };
        self.fail(&reason)
    }
}
