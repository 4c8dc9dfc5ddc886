//! Requests that move the arm or the tool's outputs.

use std::time::Instant;

use xarm_protocol::{FeedbackKind, FeedbackResult, Mode, MoveCircle, MoveJoint, MoveLine, Request, tool_address};

use super::answer::{Outcome, caution};
use super::core::{Core, Drive};
use super::model::Joints;
use super::planner::{Scene, fault};
use super::task::{Action, Goal, Move, Pose, Task, Ticket};
use super::trace::ServoPoint;
use super::units::{joints_of_wire, pose_of_wire};
use super::velocity::{Jog, Velocity};

/// rad/s and rad/s².
const JOINTS: [std::ops::RangeInclusive<f64>; 2] = [0.001..=std::f64::consts::PI, 0.01..=20.0];
/// m/s and m/s².
const TOOL: [std::ops::RangeInclusive<f64>; 2] = [0.0001..=1.0, 0.001..=50.0];
/// Longest pause in the queue, seconds.
const LONGEST_PAUSE: f32 = 86_400.0;

impl Core {
    pub(super) fn motion(&mut self, request: &Request, ticket: &Ticket, at: Instant) -> Option<Outcome> {
        Some(match request {
            Request::MoveJoint(joint) => self.move_joint(joint, ticket),
            Request::MoveLine(line) => self.move_line(line, ticket),
            Request::MoveCircle(circle) => self.move_circle(circle, ticket),
            Request::GoHome { speed, acceleration } => {
                let goal = Goal::Joints([0.0; 7]);
                self.enqueue_move(goal, true, [*speed, *acceleration], None, false, ticket)
            }
            Request::PauseTime(seconds) if (0.0..=LONGEST_PAUSE).contains(seconds) => {
                self.enqueue(Action::Pause(f64::from(*seconds)), ticket)
            }
            Request::PauseTime(_) => Outcome::Invalid,
            Request::SetTcpLoad {
                mass,
                centre: [x, y, z],
            } => match [*mass, *x, *y, *z] {
                load if *mass >= 0.0 && load.iter().all(|number| number.is_finite()) => {
                    self.enqueue(Action::Load(load), ticket)
                }
                _ => Outcome::Invalid,
            },
            Request::QueueMarker => self.enqueue(Action::Marker, ticket),
            Request::ServoJoint { angles, .. } => self.servo_joint(&joints_of_wire(angles), at),
            Request::ServoCartesian { pose, in_tool } => self.servo_cartesian(pose, *in_tool, at),
            Request::JointVelocity {
                velocities,
                synchronous,
                duration,
            } => {
                let velocity = Velocity::Joints {
                    wanted: joints_of_wire(velocities),
                    now: [0.0; 7],
                    synchronous: *synchronous,
                };
                self.jog(velocity, *duration)
            }
            Request::CartesianVelocity {
                velocity: twist,
                in_tool,
                duration,
            } => {
                let velocity = Velocity::Tool {
                    wanted: std::array::from_fn(|axis| f64::from(twist[axis]) * if axis < 3 { 1e-3 } else { 1.0 }),
                    now: [0.0; 6],
                    in_tool: *in_tool,
                };
                self.jog(velocity, *duration)
            }
            _ => return None,
        })
    }

    fn move_joint(&mut self, joint: &MoveJoint, ticket: &Ticket) -> Outcome {
        let is_valid = joint.angles.iter().all(|angle| angle.is_finite());
        let goal = Goal::Joints(joints_of_wire(&joint.angles));
        // Given in degrees.
        let blend = joint
            .radius
            .filter(|radius| *radius >= 0.0)
            .map(|radius| f64::from(radius).to_radians());
        let only_check = joint.check_only == Some(true);
        self.enqueue_move(
            goal,
            is_valid,
            [joint.speed, joint.acceleration],
            blend,
            only_check,
            ticket,
        )
    }

    fn move_line(&mut self, line: &MoveLine, ticket: &Ticket) -> Outcome {
        let options = line.options;
        let keeps = self.firmware().has_immediate_tool_io();
        let is_valid = line
            .pose
            .iter()
            .all(|number| number.is_finite() || (keeps && *number == xarm_protocol::KEEP));
        let goal = Goal::Line(Pose {
            numbers: line.pose,
            axis_angle: options.is_some_and(|options| options.axis_angle),
            in_tool: options.is_some_and(|options| options.in_tool),
        });
        let radius = options.map(|options| options.radius).filter(|radius| *radius >= 0.0);
        let blend = radius.map(|radius| f64::from(radius) * 1e-3);
        let only_check = options.is_some_and(|options| options.check_only);
        let rates = [line.speed, line.acceleration];
        self.enqueue_move(goal, is_valid, rates, blend, only_check, ticket)
    }

    fn move_circle(&mut self, circle: &MoveCircle, ticket: &Ticket) -> Outcome {
        let options = circle.options;
        let pose = |numbers| Pose {
            numbers,
            axis_angle: options.is_some_and(|options| options.axis_angle),
            in_tool: options.is_some_and(|options| options.in_tool),
        };
        let goal = Goal::Circle {
            through: pose(circle.through),
            to: pose(circle.to),
            share: f64::from(circle.percent) / 100.0,
        };
        let is_finite = circle.through.iter().chain(&circle.to).all(|number| number.is_finite());
        let is_valid = is_finite && circle.percent.is_finite() && circle.percent >= 0.0;
        let only_check = options.is_some_and(|options| options.check_only);
        let rates = [circle.speed, circle.acceleration];
        self.enqueue_move(goal, is_valid, rates, None, only_check, ticket)
    }

    /// `rates` are speed and acceleration as on the wire; those outside of what the arm can do are taken as its ends.
    fn enqueue_move(
        &mut self,
        goal: Goal,
        is_valid: bool,
        rates: [f32; 2],
        blend: Option<f64>,
        only_check: bool,
        ticket: &Ticket,
    ) -> Outcome {
        let (scale, allowed) = match goal {
            Goal::Joints(_) => (1.0, JOINTS),
            Goal::Line(_) | Goal::Circle { .. } => (1e-3, TOOL),
        };
        let rates = rates.map(|rate| f64::from(rate) * scale);
        if !is_valid || !rates.iter().all(|rate| rate.is_finite() && *rate > 0.0) {
            return Outcome::Invalid;
        }
        let clamp = |index: usize| rates[index].clamp(*allowed[index].start(), *allowed[index].end());
        let motion = Move {
            goal,
            speed: clamp(0),
            acceleration: clamp(1),
            blend,
        };
        if only_check {
            return self.check_move(&motion);
        }
        if self.is_ready() && self.mode != Mode::Position {
            return Outcome::Invalid;
        }
        self.enqueue(Action::Move(motion), ticket)
    }

    fn check_move(&self, motion: &Move) -> Outcome {
        let (joints, flange_from_tool) = (self.angles(), self.settings.flange_from_tool());
        let scene = Scene {
            model: &self.model,
            joints: &joints,
            flange_from_tool: &flange_from_tool,
        };
        Outcome::Data(vec![0, 0, scene.check(motion).err().unwrap_or(0)])
    }

    /// Into the queue of mode 0; where nothing waits, what takes no time is done at once.
    pub(super) fn enqueue(&mut self, action: Action, ticket: &Ticket) -> Outcome {
        let is_ready = self.is_ready();
        let is_idle = self.mode != Mode::Position || !is_ready || self.planner.count() == 0;
        let task = Task {
            ticket: *ticket,
            action,
        };
        match task.action {
            Action::Move(_) | Action::Pause(_) if !is_ready => {
                self.tell(ticket, FeedbackKind::End, FeedbackResult::Discarded);
            }
            Action::Outputs(_) | Action::Load(_) | Action::Marker if is_idle => self.handle(&task.instant()),
            _ if self.planner.is_full() => self.warn(caution::QUEUE_FULL),
            _ => self.planner.push(task),
        }
        Outcome::Done
    }

    fn servo_joint(&mut self, angles: &Joints, at: Instant) -> Outcome {
        let outcome = self.servo(angles, at);
        self.trace.push(ServoPoint {
            at,
            angles: *angles,
            taken: matches!(outcome, Outcome::Done) && self.is_ready(),
        });
        outcome
    }

    fn servo(&mut self, angles: &Joints, at: Instant) -> Outcome {
        if angles.iter().any(|angle| !angle.is_finite()) {
            return Outcome::Invalid;
        }
        if !self.is_ready() {
            return Outcome::Done;
        }
        if self.mode != Mode::Servo {
            return Outcome::Invalid;
        }
        if let Err(code) = self.aim(angles, at) {
            self.fail(code);
        }
        Outcome::Done
    }

    fn servo_cartesian(&mut self, pose: &[f32; 6], in_tool: bool, at: Instant) -> Outcome {
        if pose.iter().any(|number| !number.is_finite()) {
            return Outcome::Invalid;
        }
        let near = match &self.drive {
            Drive::Servo(servo) => servo.target,
            _ => self.angles(),
        };
        let tool = self.settings.flange_from_tool();
        let pose = if in_tool {
            self.model.flange(&near) * tool * pose_of_wire(pose)
        } else {
            pose_of_wire(pose)
        };
        match self.model.follow(&(pose * tool.inverse()), &near) {
            Ok(angles) => self.servo(&angles, at),
            Err(_) if self.is_ready() && self.mode == Mode::Servo => {
                self.fail(fault::NO_SOLUTION);
                Outcome::Done
            }
            Err(_) => Outcome::Done,
        }
    }

    fn jog(&mut self, velocity: Velocity, duration: Option<f32>) -> Outcome {
        let (numbers, mode): (&[f64], _) = match &velocity {
            Velocity::Joints { wanted, .. } => (wanted, Mode::JointVelocity),
            Velocity::Tool { wanted, .. } => (wanted, Mode::CartesianVelocity),
        };
        let seconds = duration.filter(|_| self.firmware().has_velocity_duration());
        if numbers.iter().any(|number| !number.is_finite()) || seconds.is_some_and(|seconds| !seconds.is_finite()) {
            return Outcome::Invalid;
        }
        if !self.is_ready() {
            return Outcome::Done;
        }
        if self.mode != mode {
            return Outcome::Invalid;
        }
        if let Drive::Jog(jog) = &mut self.drive {
            *jog = Jog {
                velocity: jog.velocity.towards(velocity),
                // 0 and less: until another comes.
                left: seconds.map(f64::from).filter(|seconds| *seconds > 0.0),
            };
        }
        Outcome::Done
    }

    pub(super) fn tool_request(&mut self, request: &Request, ticket: &Ticket) -> Option<Outcome> {
        Some(match request {
            Request::ToolRead { address } => match self.tool.read(*address) {
                Some(value) => Outcome::Data(value.to_be_bytes().to_vec()),
                None => Outcome::Invalid,
            },
            Request::ToolWrite {
                address: tool_address::SET_OUTPUTS,
                value,
                in_queue,
            } => {
                let immediate = *in_queue == Some(false) && self.firmware().has_immediate_tool_io();
                match value {
                    _ if !(0.0..=f32::from(u16::MAX)).contains(value) => Outcome::Invalid,
                    _ if immediate => {
                        self.tool.set_outputs(*value as u16);
                        self.tell(ticket, FeedbackKind::Triggered, FeedbackResult::Done);
                        Outcome::Done
                    }
                    _ => self.enqueue(Action::Outputs(*value as u16), ticket),
                }
            }
            Request::ToolWrite { .. } => Outcome::Invalid,
            _ => return None,
        })
    }
}
