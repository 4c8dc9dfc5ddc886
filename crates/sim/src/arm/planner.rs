//! Mode 0: the queue of motions, one after the other or with rounded corners.

use std::collections::VecDeque;

use geometry::RigidTransform;
use geometry::nalgebra::Vector3;
use xarm_protocol::{FeedbackKind, FeedbackResult};

use super::model::{ArmModel, Joints};
use super::segment::{Place, Segment, Way};
use super::task::{Action, Goal, Move, Task, Ticket};

/// Commands that the queue holds.
pub(super) const MOST: usize = 1024;
/// From full speed to nothing on a pause, and back, seconds.
const PAUSING: f64 = 0.2;

/// Numbers of the controller's errors that a motion may end with.
pub(super) mod fault {
    pub(crate) const KINEMATICS: u8 = 21;
    pub(crate) const SELF_COLLISION: u8 = 22;
    pub(crate) const JOINT_RANGE: u8 = 23;
    pub(crate) const JOINT_SPEED: u8 = 24;
    pub(crate) const CIRCLE: u8 = 32;
    pub(crate) const NO_SOLUTION: u8 = 40;
    pub(crate) const TOOL_SPEED: u8 = 60;
}

/// What happened to commands in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Event {
    /// To be told to who asked.
    Feedback(Ticket, FeedbackKind, FeedbackResult),
    /// The tool's outputs are due.
    Outputs(u16),
    /// So is another load.
    Load([f32; 4]),
}

/// What is under way.
#[derive(Debug)]
struct Running {
    ticket: Ticket,
    what: Doing,
}

#[derive(Debug)]
enum Doing {
    Segment(Box<Segment>),
    /// Seconds that are left.
    Pause(f64),
}

#[derive(Debug)]
pub(super) struct Planner {
    waiting: VecDeque<Task>,
    active: Option<Running>,
    /// Begun while the active one ends.
    next: Option<(Ticket, Box<Segment>)>,
    /// Of time: 0 while paused.
    rate: f64,
    is_paused: bool,
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            waiting: VecDeque::new(),
            active: None,
            next: None,
            rate: 1.0,
            is_paused: false,
        }
    }
}

/// The arm as a step finds it.
pub(super) struct Scene<'a> {
    pub(super) model: &'a ArmModel,
    pub(super) joints: &'a Joints,
    pub(super) flange_from_tool: &'a RigidTransform,
}

impl Planner {
    pub(super) fn count(&self) -> usize {
        self.waiting.len() + usize::from(self.active.is_some()) + usize::from(self.next.is_some())
    }

    pub(super) fn is_full(&self) -> bool {
        self.count() >= MOST
    }

    pub(super) fn push(&mut self, task: Task) {
        self.waiting.push_back(task);
    }

    pub(super) fn set_paused(&mut self, is_paused: bool) {
        self.is_paused = is_paused;
    }

    /// Forgets everything; who asked is told.
    pub(super) fn clear(&mut self) -> Vec<Event> {
        let active = self.active.take().map(|running| running.ticket);
        let next = self.next.take().map(|(ticket, _)| ticket);
        let waiting = self.waiting.drain(..).map(|task| task.ticket);
        let all: Vec<Ticket> = active.into_iter().chain(next).chain(waiting).collect();
        (self.is_paused, self.rate) = (false, 1.0);
        all.into_iter()
            .map(|ticket| Event::Feedback(ticket, FeedbackKind::End, FeedbackResult::Discarded))
            .collect()
    }

    /// Goes on by some seconds: where the joints are then, none when nothing moves them; the number of an error that
    /// ends all.
    pub(super) fn step(
        &mut self,
        seconds: f64,
        scene: &Scene<'_>,
        events: &mut Vec<Event>,
    ) -> Result<Option<Joints>, u8> {
        self.begin(scene, events)?;
        let change = seconds / PAUSING;
        let wanted = if self.is_paused { 0.0 } else { 1.0 };
        self.rate += (wanted - self.rate).clamp(-change, change);
        let seconds = seconds * self.rate;
        let Some(active) = &mut self.active else {
            // Nothing is under way: a pause takes hold at once.
            self.rate = wanted;
            return Ok(None);
        };
        let place = match &mut active.what {
            Doing::Pause(left) => {
                *left -= seconds;
                if *left <= 0.0 {
                    self.finish(events);
                }
                return Ok(None);
            }
            Doing::Segment(segment) => {
                segment.advance(seconds);
                segment.place()
            }
        };
        self.begin_next(seconds, scene, events)?;
        let place = self.next.as_ref().map_or(place, |(_, next)| place.plus(next));
        if matches!(&self.active, Some(Running { what: Doing::Segment(segment), .. }) if segment.is_over()) {
            self.finish(events);
        }
        scene.joints_at(&place).map(Some)
    }

    fn finish(&mut self, events: &mut Vec<Event>) {
        if let Some(done) = self.active.take() {
            events.push(Event::Feedback(done.ticket, FeedbackKind::End, FeedbackResult::Done));
        }
        self.active = self.next.take().map(|(ticket, segment)| Running {
            ticket,
            what: Doing::Segment(segment),
        });
    }

    /// Takes from the queue until something is under way.
    fn begin(&mut self, scene: &Scene<'_>, events: &mut Vec<Event>) -> Result<(), u8> {
        while self.active.is_none() && !self.is_paused {
            let Some(task) = self.waiting.pop_front() else {
                break;
            };
            events.extend(task.instant());
            let what = match &task.action {
                Action::Move(motion) => Doing::Segment(Box::new(begin_move(motion, task.ticket, scene, events)?)),
                Action::Pause(seconds) => Doing::Pause(*seconds),
                Action::Outputs(_) | Action::Load(_) | Action::Marker => continue,
            };
            let ticket = task.ticket;
            self.active = Some(Running { ticket, what });
        }
        Ok(())
    }

    /// Lets the next motion begin in the end of this one where a corner is to be rounded; goes on with it.
    fn begin_next(&mut self, seconds: f64, scene: &Scene<'_>, events: &mut Vec<Event>) -> Result<(), u8> {
        if let Some((_, next)) = &mut self.next {
            next.advance(seconds);
            return Ok(());
        }
        let Some(Running {
            what: Doing::Segment(segment),
            ..
        }) = &self.active
        else {
            return Ok(());
        };
        let Some(Task {
            ticket,
            action: Action::Move(motion),
        }) = self.waiting.front()
        else {
            return Ok(());
        };
        let corner = segment.end();
        if !segment.lets_next_begin() || !corner.is_of_kind(&scene.start_of(&motion.goal)) {
            return Ok(());
        }
        let (ticket, next) = (*ticket, scene.plan(motion, &corner)?);
        self.waiting.pop_front();
        events.push(Event::Feedback(ticket, FeedbackKind::Start, FeedbackResult::Done));
        self.next = Some((ticket, Box::new(next)));
        Ok(())
    }
}

/// That it begins is told before that it fails.
fn begin_move(motion: &Move, ticket: Ticket, scene: &Scene<'_>, events: &mut Vec<Event>) -> Result<Segment, u8> {
    events.push(Event::Feedback(ticket, FeedbackKind::Start, FeedbackResult::Done));
    scene.plan(motion, &scene.start_of(&motion.goal)).inspect_err(|_| {
        events.push(Event::Feedback(ticket, FeedbackKind::End, FeedbackResult::Failed));
    })
}

impl Task {
    /// What comes of it where it takes no time; nothing yet for what does.
    pub(super) fn instant(&self) -> Vec<Event> {
        let done = |kind| Event::Feedback(self.ticket, kind, FeedbackResult::Done);
        match self.action {
            Action::Outputs(value) => vec![Event::Outputs(value), done(FeedbackKind::Triggered)],
            Action::Load(load) => vec![Event::Load(load), done(FeedbackKind::End)],
            Action::Marker => vec![done(FeedbackKind::End)],
            Action::Move(_) | Action::Pause(_) => Vec::new(),
        }
    }
}

impl Scene<'_> {
    fn base_from_tool(&self) -> RigidTransform {
        self.model.flange(self.joints) * *self.flange_from_tool
    }

    /// Where a motion to this goal begins now.
    fn start_of(&self, goal: &Goal) -> Place {
        match goal {
            Goal::Joints(_) => Place::Joints(*self.joints),
            Goal::Line(_) | Goal::Circle { .. } => Place::Tool(self.base_from_tool()),
        }
    }

    /// Refuses what cannot be reached.
    pub(super) fn plan(&self, motion: &Move, start: &Place) -> Result<Segment, u8> {
        let way = match (&motion.goal, start) {
            (Goal::Joints(to), Place::Joints(from)) => {
                if self.model.outside(to).is_some() {
                    return Err(fault::JOINT_RANGE);
                }
                Way::Joints { from: *from, to: *to }
            }
            (Goal::Line(pose), Place::Tool(from)) => {
                let to = pose.resolve(from);
                self.require_reachable(&to)?;
                Way::Line { from: *from, to }
            }
            (Goal::Circle { through, to, share }, Place::Tool(from)) => {
                arc(from, &through.resolve(from), &to.resolve(from), *share)?
            }
            _ => return Err(fault::KINEMATICS),
        };
        Ok(Segment::new(way, motion.speed, motion.acceleration, motion.blend))
    }

    /// Whether a motion could be done from here on.
    pub(super) fn check(&self, motion: &Move) -> Result<(), u8> {
        self.plan(motion, &self.start_of(&motion.goal)).map(|_| ())
    }

    fn require_reachable(&self, base_from_tool: &RigidTransform) -> Result<(), u8> {
        let flange = *base_from_tool * self.flange_from_tool.inverse();
        let found = self.model.reach(&flange, self.joints);
        found.map(|_| ()).map_err(|_| fault::NO_SOLUTION)
    }

    fn joints_at(&self, place: &Place) -> Result<Joints, u8> {
        match place {
            Place::Joints(joints) => Ok(*joints),
            Place::Tool(tool) => {
                let flange = *tool * self.flange_from_tool.inverse();
                let found = self.model.follow(&flange, self.joints);
                found.map_err(|_| fault::KINEMATICS)
            }
        }
    }
}

/// The circle through three points: from the first through the second, over a share of its whole turn.
fn arc(from: &RigidTransform, through: &RigidTransform, to: &RigidTransform, share: f64) -> Result<Way, u8> {
    let (a, b) = (
        through.translation() - from.translation(),
        to.translation() - from.translation(),
    );
    let normal = a.cross(&b);
    let square = normal.norm_squared();
    if square < 1e-12 {
        return Err(fault::CIRCLE);
    }
    let to_centre = (normal.cross(&a) * b.norm_squared() + b.cross(&normal) * a.norm_squared()) / (2.0 * square);
    let axis: Vector3<f64> = normal / square.sqrt();
    Ok(Way::Arc {
        from: *from,
        // Only the origin goes round; the tool keeps its rotation.
        to: RigidTransform::from_parts(to.translation(), from.rotation()),
        centre: from.translation() + to_centre,
        turn: axis * (share * std::f64::consts::TAU),
    })
}
