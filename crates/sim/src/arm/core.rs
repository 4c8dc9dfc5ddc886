//! The controller's state machine: what it does every 4 ms, and how it gets from one state to the next.

use std::time::Instant;

use geometry::RigidTransform;
use trajectory::{JointLimits, State as JointState, Stop};
use xarm_protocol::{Feedback, FeedbackKind, FeedbackResult, Firmware, Frame, Mode, State, Status};

use super::STEP;
use super::collision::touches_itself;
use super::config::ArmConfig;
use super::error::ArmError;
use super::model::{ArmModel, Joints};
use super::planner::{Event, Planner, Scene, fault};
use super::servo::{JOINT_SPEED, Servo};
use super::settings::Settings;
use super::task::Ticket;
use super::tool::ToolBoard;
use super::trace::ServoTrace;
use super::velocity::Jog;

/// All seven axes.
pub(super) const ALL_AXES: u8 = 0x7F;
/// Of a stop at once and of a gentle one, rad/s².
const STOPPING: [f64; 2] = [20.0, 5.0];
const STOPPING_JERK: f64 = 2000.0;
/// A joint that is slower rests, rad/s.
const RESTING: f64 = 1e-7;

/// What moves the joints.
pub(super) enum Drive {
    /// Nothing.
    Rest,
    Queue,
    Servo(Servo),
    Jog(Jog),
    Stopping {
        stop: Box<Stop<7>>,
        time: f64,
    },
}

pub(super) struct Core {
    pub(super) config: ArmConfig,
    pub(super) model: ArmModel,
    pub(super) settings: Settings,
    pub(super) mode: Mode,
    /// Moving and ready are told apart only when asked.
    pub(super) state: State,
    pub(super) error: u8,
    pub(super) warning: u8,
    /// A bit for each axis.
    pub(super) enabled: u8,
    /// Error that comes back as long as a button is pressed.
    pub(super) pressed: Option<u8>,
    pub(super) joints: [JointState; 7],
    pub(super) drive: Drive,
    pub(super) planner: Planner,
    pub(super) tool: ToolBoard,
    pub(super) trace: ServoTrace,
    /// Of tool, m/s.
    pub(super) tool_speed: f64,
    touches_itself: bool,
    /// Something was in the cup a step ago.
    holds: bool,
    pub(super) tasks: u16,
    pub(super) micros: u64,
    /// To be sent, with the client's number.
    pub(super) outbox: Vec<(u64, Frame)>,
}

impl Core {
    pub(super) fn new(config: ArmConfig) -> Result<Self, ArmError> {
        config.identity.firmware.require_supported()?;
        if config.identity.axes != 7 {
            return Err(ArmError::Axes {
                axes: config.identity.axes,
            });
        }
        let model = ArmModel::new(&config)?;
        Ok(Self {
            joints: config.joints.map(JointState::at),
            touches_itself: touches_itself(&model.links(&config.joints)),
            tool: ToolBoard::new(config.vacuum),
            config,
            model,
            settings: Settings::default(),
            mode: Mode::Position,
            state: State::Stopped,
            error: 0,
            warning: 0,
            enabled: 0,
            pressed: None,
            drive: Drive::Rest,
            planner: Planner::default(),
            trace: ServoTrace::default(),
            tool_speed: 0.0,
            holds: false,
            tasks: 0,
            micros: 0,
            outbox: Vec::new(),
        })
    }

    /// Power off and on: the arm stays where it is, everything else is as at first.
    pub(super) fn restart(&mut self) {
        let angles = self.angles();
        let (pressed, never_seals) = (self.pressed, self.tool.never_seals);
        self.settings = Settings::default();
        self.tool = ToolBoard::new(self.config.vacuum);
        self.tool.never_seals = never_seals;
        self.planner = Planner::default();
        self.outbox.clear();
        self.joints = angles.map(JointState::at);
        self.drive = Drive::Rest;
        (self.mode, self.state, self.enabled) = (Mode::Position, State::Stopped, 0);
        (self.error, self.warning) = (pressed.unwrap_or(0), 0);
    }

    pub(super) fn firmware(&self) -> Firmware {
        self.config.identity.firmware
    }

    pub(super) fn angles(&self) -> Joints {
        self.joints.map(|joint| joint.position)
    }

    pub(super) fn base_from_flange(&self) -> RigidTransform {
        self.model.flange(&self.angles())
    }

    pub(super) fn base_from_tool(&self) -> RigidTransform {
        self.base_from_flange() * self.settings.flange_from_tool()
    }

    /// As told to clients.
    pub(super) fn reported_state(&self) -> State {
        let moves = self.planner.count() > 0 || self.joints.iter().any(|joint| joint.velocity.abs() > RESTING);
        match self.state {
            State::Ready if moves => State::Moving,
            state => state,
        }
    }

    pub(super) fn is_ready(&self) -> bool {
        self.error == 0 && self.enabled == ALL_AXES && self.state.takes_commands()
    }

    /// What comes with every reply.
    pub(super) fn status(&self) -> Status {
        let bit = |is_set: bool, bit: Status| if is_set { bit } else { Status::FINE };
        bit(self.error != 0, Status::ERROR)
            .and(bit(self.warning != 0, Status::WARNING))
            .and(bit(!self.is_ready(), Status::NOT_READY))
    }

    /// 4 ms later.
    pub(super) fn step(&mut self) {
        self.micros += (STEP * 1e6) as u64;
        let outcome = self.next_angles().and_then(|angles| self.check_step(angles));
        match outcome {
            Ok(angles) => self.go_to(&angles),
            Err(code) => {
                self.fail(code);
                // The stop begins in the same step; nothing refuses it.
                let stopping = self.next_angles().and_then(|angles| self.check_step(angles));
                self.go_to(&stopping.unwrap_or_else(|_| self.angles()));
            }
        }
        self.step_tool();
    }

    fn next_angles(&mut self) -> Result<Joints, u8> {
        let angles = self.angles();
        let flange_from_tool = self.settings.flange_from_tool();
        match &mut self.drive {
            Drive::Rest => Ok(angles),
            Drive::Servo(servo) => Ok(servo.step(&angles)),
            Drive::Jog(jog) => jog.step(&self.settings.accelerations(), &self.model, &angles, &flange_from_tool),
            Drive::Stopping { stop, time } => {
                *time += STEP;
                Ok(stop.sample(*time).map(|joint| joint.position))
            }
            Drive::Queue => {
                let scene = Scene {
                    model: &self.model,
                    joints: &angles,
                    flange_from_tool: &flange_from_tool,
                };
                let mut events = Vec::new();
                let outcome = self.planner.step(STEP, &scene, &mut events);
                self.handle(&events);
                Ok(outcome?.unwrap_or(angles))
            }
        }
    }

    fn check_step(&mut self, angles: Joints) -> Result<Joints, u8> {
        let now = self.angles();
        if angles.iter().zip(&now).all(|(next, now)| next.total_cmp(now).is_eq()) {
            return Ok(angles);
        }
        let touched = self.touches_itself;
        let touches = touches_itself(&self.model.links(&angles));
        if matches!(self.drive, Drive::Stopping { .. }) {
            self.touches_itself = touches;
            return Ok(angles);
        }
        if (0..7).any(|joint| (angles[joint] - now[joint]).abs() > JOINT_SPEED * STEP * (1.0 + 1e-6)) {
            return Err(fault::JOINT_SPEED);
        }
        // What touches already may be moved apart.
        if touches && !touched && self.settings.checks_self_collision {
            return Err(fault::SELF_COLLISION);
        }
        self.touches_itself = touches;
        Ok(angles)
    }

    fn go_to(&mut self, angles: &Joints) {
        let before = self.base_from_tool().translation();
        for (joint, angle) in self.joints.iter_mut().zip(angles) {
            let velocity = (angle - joint.position) / STEP;
            *joint = JointState {
                position: *angle,
                velocity,
                acceleration: (velocity - joint.velocity) / STEP,
            };
        }
        self.tool_speed = (self.base_from_tool().translation() - before).norm() / STEP;
        self.end_stop();
    }

    fn end_stop(&mut self) {
        let Drive::Stopping { stop, time } = &self.drive else {
            return;
        };
        if *time < stop.duration() {
            return;
        }
        if self.state == State::Decelerating {
            self.state = State::Stopped;
        }
        let goes_on = self.is_ready() && self.state != State::Paused;
        self.drive = if goes_on { self.drive_of_mode() } else { Drive::Rest };
    }

    fn step_tool(&mut self) {
        let base_from_cup = self.base_from_flange() * self.config.flange_from_cup;
        let suction = self.config.suction.as_deref();
        self.tool
            .step(STEP, || suction.and_then(|world| world.touched(&base_from_cup)));
        let held_before = std::mem::replace(&mut self.holds, self.tool.held().is_some());
        match suction {
            Some(world) if self.holds && !held_before => world.sealed(&base_from_cup),
            Some(world) if held_before && !self.holds => world.released(&base_from_cup),
            _ => {}
        }
    }

    pub(super) fn drive_of_mode(&self) -> Drive {
        match self.mode {
            Mode::Position => Drive::Queue,
            Mode::Servo => Drive::Servo(Servo::at(&self.angles())),
            Mode::JointVelocity => Drive::Jog(Jog::joints()),
            Mode::CartesianVelocity => Drive::Jog(Jog::tool()),
            Mode::FreeDrive | Mode::JointOnline | Mode::CartesianOnline => Drive::Rest,
        }
    }

    /// An error: all is forgotten, the arm stops, mode 0, motors off until they are enabled again.
    pub(super) fn fail(&mut self, code: u8) {
        if self.error == 0 {
            tracing::warn!("the simulated arm's error {code}");
            self.error = code;
        }
        self.halt(State::Stopped, STOPPING[0]);
        self.mode = Mode::Position;
        self.enabled = 0;
    }

    /// At once, as hard as the joints can.
    pub(super) fn stop(&mut self, state: State) {
        self.halt(state, STOPPING[0]);
    }

    /// Gently; the state is 4 when the arm rests.
    pub(super) fn decelerate(&mut self) {
        self.halt(State::Decelerating, STOPPING[1]);
        self.end_stop();
    }

    fn halt(&mut self, state: State, acceleration: f64) {
        let events = self.planner.clear();
        self.handle(&events);
        self.state = state;
        if matches!(self.drive, Drive::Stopping { .. }) {
            return;
        }
        let limits = [JointLimits {
            lower: -10.0,
            upper: 10.0,
            velocity: JOINT_SPEED,
            acceleration,
            jerk: STOPPING_JERK,
        }; 7];
        // What the difference of positions gives as acceleration jumps where a motion's does.
        let states = self.joints.map(|joint| JointState {
            acceleration: joint.acceleration.clamp(-acceleration, acceleration),
            ..joint
        });
        self.drive = match Stop::from(&states, &limits) {
            Ok(stop) => Drive::Stopping {
                stop: Box::new(stop),
                time: 0.0,
            },
            Err(_) => Drive::Rest,
        };
    }

    /// A set-point of servo mode, radians.
    pub(super) fn aim(&mut self, angles: &Joints, at: Instant) -> Result<(), u8> {
        if self.model.outside(angles).is_some() {
            return Err(fault::JOINT_RANGE);
        }
        let tool = self.settings.flange_from_tool();
        let Drive::Servo(servo) = &mut self.drive else {
            // Still coming to rest from what was before.
            return Ok(());
        };
        let place = |angles: &Joints| (self.model.flange(angles) * tool).translation();
        let way = (place(angles) - place(&servo.target)).norm();
        servo.aim(angles, way, at)
    }

    pub(super) fn handle(&mut self, events: &[Event]) {
        for event in events {
            match event {
                Event::Outputs(value) => self.tool.set_outputs(*value),
                Event::Load(load) => self.settings.load = *load,
                Event::Feedback(ticket, kind, result) => self.tell(ticket, *kind, *result),
            }
        }
    }

    pub(super) fn tell(&mut self, ticket: &Ticket, kind: FeedbackKind, result: FeedbackResult) {
        let bit = match kind {
            FeedbackKind::Start => 1,
            FeedbackKind::End => 2,
            FeedbackKind::Triggered => 4,
            FeedbackKind::Other(_) => 0,
        };
        if ticket.client == 0 || ticket.feedback & bit == 0 || !self.firmware().has_feedback() {
            return;
        }
        let feedback = Feedback {
            transaction: ticket.transaction,
            kind,
            register: ticket.register,
            task: ticket.task,
            result,
            micros: self.micros,
        };
        self.outbox.push((ticket.client, feedback.frame(ticket.protocol)));
    }
}
