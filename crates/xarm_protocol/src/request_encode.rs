//! Requests to bytes.

use crate::bytes::put_floats;
use crate::frame::{Protocol, put_header};
use crate::register;
use crate::request::{MoveCircle, MoveJoint, MoveLine, Request};
use crate::tool_io::TOOL_HOST;

impl Request {
    /// Number of the register.
    pub fn register(&self) -> u8 {
        match self {
            Self::Version => register::VERSION,
            Self::SerialNumbers => register::SERIAL_NUMBERS,
            Self::MotionEnable { .. } => register::MOTION_ENABLE,
            Self::SetState(_) => register::SET_STATE,
            Self::GetState => register::GET_STATE,
            Self::GetQueued => register::GET_QUEUED,
            Self::GetError => register::GET_ERROR,
            Self::CleanError => register::CLEAN_ERROR,
            Self::CleanWarning => register::CLEAN_WARNING,
            Self::SetMode(_) => register::SET_MODE,
            Self::MoveLine(_) => register::MOVE_LINE,
            Self::MoveJoint(MoveJoint { radius: None, .. }) => register::MOVE_JOINT,
            Self::MoveJoint(_) => register::MOVE_JOINT_BLENDED,
            Self::MoveCircle(_) => register::MOVE_CIRCLE,
            Self::GoHome { .. } => register::GO_HOME,
            Self::PauseTime(_) => register::PAUSE_TIME,
            Self::ServoJoint { .. } => register::SERVO_JOINT,
            Self::ServoCartesian { .. } => register::SERVO_CARTESIAN,
            Self::SetTcpJerk(_) => register::SET_TCP_JERK,
            Self::SetTcpAcceleration(_) => register::SET_TCP_ACCELERATION,
            Self::SetJointJerk(_) => register::SET_JOINT_JERK,
            Self::SetJointAcceleration(_) => register::SET_JOINT_ACCELERATION,
            Self::SetTcpOffset(_) => register::SET_TCP_OFFSET,
            Self::SetTcpLoad { .. } => register::SET_TCP_LOAD,
            Self::SetCollisionSensitivity(_) => register::SET_COLLISION_SENSITIVITY,
            Self::SetTeachSensitivity(_) => register::SET_TEACH_SENSITIVITY,
            Self::ClearConfiguration => register::CLEAR_CONFIGURATION,
            Self::SaveConfiguration => register::SAVE_CONFIGURATION,
            Self::GetTcpPose => register::GET_TCP_POSE,
            Self::GetJoints { .. } => register::GET_JOINTS,
            Self::InverseKinematics(_) => register::INVERSE_KINEMATICS,
            Self::ForwardKinematics(_) => register::FORWARD_KINEMATICS,
            Self::JointLimitCheck(_) => register::JOINT_LIMIT_CHECK,
            Self::TcpLimitCheck(_) => register::TCP_LIMIT_CHECK,
            Self::SetGravity(_) => register::SET_GRAVITY,
            Self::SetWorldOffset(_) => register::SET_WORLD_OFFSET,
            Self::SelfCollisionCheck(_) => register::SELF_COLLISION_CHECK,
            Self::ToolShape(_) => register::TOOL_SHAPE,
            Self::Simulation(_) => register::SIMULATION,
            Self::GetMovement => register::GET_MOVEMENT,
            Self::BoxInputs => register::BOX_INPUTS,
            Self::GetJointTorques => register::GET_JOINT_TORQUES,
            Self::GetCalibratedDh => register::GET_CALIBRATED_DH,
            Self::JointVelocity { .. } => register::JOINT_VELOCITY,
            Self::CartesianVelocity { .. } => register::CARTESIAN_VELOCITY,
            Self::ServoDebug => register::SERVO_DEBUG,
            Self::ToolWrite { .. } => register::TOOL_WRITE,
            Self::ToolRead { .. } => register::TOOL_READ,
            Self::QueueMarker => register::QUEUE_MARKER,
            Self::SetFeedback(_) => register::SET_FEEDBACK,
            Self::Unknown { register, .. } => *register,
        }
    }

    /// Appends a whole frame; allocates nothing when the room is there.
    pub fn encode_into(&self, transaction: u16, protocol: Protocol, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        put_header(bytes, transaction, protocol, 0);
        bytes.push(self.register());
        let body = bytes.len() - 1;
        self.put_parameters(bytes);
        let length = (bytes.len() - body) as u16;
        bytes[start + 4..start + 6].copy_from_slice(&length.to_be_bytes());
    }

    pub(crate) fn put_parameters(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::MotionEnable { axis, on } => bytes.extend([*axis, u8::from(*on)]),
            Self::SetState(command) => bytes.push(command.number()),
            Self::SetMode(mode) => bytes.push(mode.number()),
            Self::MoveLine(line) => put_line(line, bytes),
            Self::MoveJoint(joint) => put_joint(joint, bytes),
            Self::MoveCircle(circle) => put_circle(circle, bytes),
            Self::GoHome { speed, acceleration } => put_floats(bytes, &[*speed, *acceleration, 0.0]),
            Self::ServoJoint {
                angles,
                speed,
                acceleration,
                time,
            } => {
                put_floats(bytes, angles);
                put_floats(bytes, &[*speed, *acceleration, *time]);
            }
            Self::ServoCartesian { pose, in_tool } => {
                put_floats(bytes, pose);
                put_floats(bytes, &[0.0, 0.0, f32::from(u8::from(*in_tool))]);
            }
            Self::PauseTime(value)
            | Self::SetTcpJerk(value)
            | Self::SetTcpAcceleration(value)
            | Self::SetJointJerk(value)
            | Self::SetJointAcceleration(value) => put_floats(bytes, &[*value]),
            Self::SetTcpOffset(pose)
            | Self::SetWorldOffset(pose)
            | Self::InverseKinematics(pose)
            | Self::TcpLimitCheck(pose) => put_floats(bytes, pose),
            Self::SelfCollisionCheck(on) | Self::Simulation(on) => bytes.push(u8::from(*on)),
            Self::ForwardKinematics(angles) | Self::JointLimitCheck(angles) => put_floats(bytes, angles),
            Self::SetTcpLoad { mass, centre } => {
                put_floats(bytes, &[*mass]);
                put_floats(bytes, centre);
            }
            Self::SetCollisionSensitivity(value) | Self::SetTeachSensitivity(value) | Self::SetFeedback(value) => {
                bytes.push(*value);
            }
            Self::GetJoints { parts } => bytes.extend(parts),
            Self::SetGravity(direction) => put_floats(bytes, direction),
            Self::JointVelocity {
                velocities,
                synchronous,
                duration,
            } => {
                put_floats(bytes, velocities);
                bytes.push(u8::from(*synchronous));
                put_floats(bytes, duration.as_slice());
            }
            Self::CartesianVelocity {
                velocity,
                in_tool,
                duration,
            } => {
                put_floats(bytes, velocity);
                bytes.push(u8::from(*in_tool));
                put_floats(bytes, duration.as_slice());
            }
            Self::ToolWrite {
                address,
                value,
                in_queue,
            } => {
                bytes.push(TOOL_HOST);
                bytes.extend(address.to_be_bytes());
                put_floats(bytes, &[*value]);
                bytes.extend(in_queue.map(u8::from));
            }
            Self::ToolRead { address } => {
                bytes.push(TOOL_HOST);
                bytes.extend(address.to_be_bytes());
            }
            Self::ToolShape(parameters) | Self::Unknown { parameters, .. } => bytes.extend(parameters),
            Self::Version
            | Self::SerialNumbers
            | Self::GetState
            | Self::GetQueued
            | Self::GetError
            | Self::CleanError
            | Self::CleanWarning
            | Self::ClearConfiguration
            | Self::SaveConfiguration
            | Self::GetTcpPose
            | Self::GetMovement
            | Self::BoxInputs
            | Self::GetJointTorques
            | Self::GetCalibratedDh
            | Self::ServoDebug
            | Self::QueueMarker => {}
        }
    }
}

fn put_line(line: &MoveLine, bytes: &mut Vec<u8>) {
    put_floats(bytes, &line.pose);
    put_floats(bytes, &[line.speed, line.acceleration, line.time]);
    if let Some(options) = &line.options {
        put_floats(bytes, &[options.radius]);
        bytes.extend([options.in_tool, options.axis_angle, options.check_only].map(u8::from));
        bytes.extend(options.motion_type);
    }
}

fn put_circle(circle: &MoveCircle, bytes: &mut Vec<u8>) {
    put_floats(bytes, &circle.through);
    put_floats(bytes, &circle.to);
    put_floats(bytes, &[circle.speed, circle.acceleration, circle.time, circle.percent]);
    if let Some(options) = &circle.options {
        bytes.extend([options.in_tool, options.axis_angle, options.check_only].map(u8::from));
    }
}

fn put_joint(joint: &MoveJoint, bytes: &mut Vec<u8>) {
    put_floats(bytes, &joint.angles);
    put_floats(bytes, &[joint.speed, joint.acceleration]);
    put_floats(bytes, &[joint.radius.unwrap_or(joint.time)]);
    bytes.extend(joint.check_only.map(u8::from));
}
