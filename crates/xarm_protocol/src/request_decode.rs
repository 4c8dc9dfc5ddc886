//! Requests from bytes, for controllers.

use crate::bytes::Cursor;
use crate::error::ProtocolError;
use crate::modes::{Mode, StateCommand};
use crate::register;
use crate::request::{MoveCircle, MoveCircleOptions, MoveJoint, MoveLine, MoveLineOptions, Request};
use crate::tool_io::TOOL_HOST;

impl Request {
    /// From a frame's register and parameters.
    ///
    /// # Errors
    /// Too few or too many bytes, values without meaning. A register that is not known is no error but
    /// [`Request::Unknown`].
    pub fn decode(register: u8, parameters: &[u8]) -> Result<Self, ProtocolError> {
        if let Some(request) = without_parameters(register) {
            Cursor::new("parameters", "none", parameters).end()?;
            return Ok(request);
        }
        if let Some(request) = motion(register, parameters)? {
            return Ok(request);
        }
        if let Some(request) = setting(register, parameters)? {
            return Ok(request);
        }
        Ok(Self::Unknown {
            register,
            parameters: parameters.to_vec(),
        })
    }
}

fn without_parameters(register: u8) -> Option<Request> {
    Some(match register {
        register::VERSION => Request::Version,
        register::SERIAL_NUMBERS => Request::SerialNumbers,
        register::GET_STATE => Request::GetState,
        register::GET_QUEUED => Request::GetQueued,
        register::GET_ERROR => Request::GetError,
        register::CLEAN_ERROR => Request::CleanError,
        register::CLEAN_WARNING => Request::CleanWarning,
        register::CLEAR_CONFIGURATION => Request::ClearConfiguration,
        register::SAVE_CONFIGURATION => Request::SaveConfiguration,
        register::GET_TCP_POSE => Request::GetTcpPose,
        register::GET_MOVEMENT => Request::GetMovement,
        register::BOX_INPUTS => Request::BoxInputs,
        register::GET_JOINT_TORQUES => Request::GetJointTorques,
        register::GET_CALIBRATED_DH => Request::GetCalibratedDh,
        register::SERVO_DEBUG => Request::ServoDebug,
        register::QUEUE_MARKER => Request::QueueMarker,
        _ => return None,
    })
}

fn motion(register: u8, parameters: &[u8]) -> Result<Option<Request>, ProtocolError> {
    Ok(Some(match register {
        register::MOVE_LINE => Request::MoveLine(line(parameters)?),
        register::MOVE_LINE_BLENDED => Request::MoveLine(old_blended_line(parameters)?),
        register::MOVE_JOINT => Request::MoveJoint(joint(parameters, false)?),
        register::MOVE_JOINT_BLENDED => Request::MoveJoint(joint(parameters, true)?),
        register::MOVE_CIRCLE => Request::MoveCircle(circle(parameters)?),
        register::GO_HOME => {
            let [speed, acceleration, _] = whole("go home", "12", parameters, Cursor::floats)?;
            Request::GoHome { speed, acceleration }
        }
        register::PAUSE_TIME => Request::PauseTime(whole("pause", "4", parameters, Cursor::f32)?),
        register::SERVO_JOINT => whole("servo joint", "40", parameters, |cursor| {
            let (angles, [speed, acceleration, time]) = (cursor.floats()?, cursor.floats()?);
            Ok(Request::ServoJoint {
                angles,
                speed,
                acceleration,
                time,
            })
        })?,
        register::SERVO_CARTESIAN => whole("servo cartesian", "36", parameters, |cursor| {
            let (pose, [_, _, tool]) = (cursor.floats()?, cursor.floats::<3>()?);
            Ok(Request::ServoCartesian {
                pose,
                in_tool: tool != 0.0,
            })
        })?,
        register::JOINT_VELOCITY => whole("joint velocity", "29 or 33", parameters, |cursor| {
            let (velocities, synchronous) = (cursor.floats()?, cursor.flag()?);
            Ok(Request::JointVelocity {
                velocities,
                synchronous,
                duration: optional(cursor, Cursor::f32)?,
            })
        })?,
        register::CARTESIAN_VELOCITY => whole("cartesian velocity", "25 or 29", parameters, |cursor| {
            let (velocity, in_tool) = (cursor.floats()?, cursor.flag()?);
            Ok(Request::CartesianVelocity {
                velocity,
                in_tool,
                duration: optional(cursor, Cursor::f32)?,
            })
        })?,
        _ => return Ok(None),
    }))
}

fn setting(register: u8, parameters: &[u8]) -> Result<Option<Request>, ProtocolError> {
    let number = |what| whole(what, "4", parameters, Cursor::f32);
    let byte = |what| whole(what, "1", parameters, Cursor::u8);
    Ok(Some(match register {
        register::MOTION_ENABLE => whole("motion enable", "2", parameters, |cursor| {
            let (axis, on) = (cursor.u8()?, cursor.flag()?);
            Ok(Request::MotionEnable { axis, on })
        })?,
        register::SET_STATE => Request::SetState(StateCommand::try_from(byte("set state")?)?),
        // A second byte, the detection, changes nothing that a client could see.
        register::SET_MODE => Request::SetMode(Mode::try_from(whole("set mode", "1 or 2", parameters, |cursor| {
            let mode = cursor.u8()?;
            optional(cursor, Cursor::u8)?;
            Ok(mode)
        })?)?),
        register::SET_TCP_JERK => Request::SetTcpJerk(number("tool jerk")?),
        register::SET_TCP_ACCELERATION => Request::SetTcpAcceleration(number("tool acceleration")?),
        register::SET_JOINT_JERK => Request::SetJointJerk(number("joint jerk")?),
        register::SET_JOINT_ACCELERATION => Request::SetJointAcceleration(number("joint acceleration")?),
        register::SET_TCP_OFFSET => Request::SetTcpOffset(whole("tool offset", "24", parameters, Cursor::floats)?),
        register::SET_TCP_LOAD => whole("tool load", "16", parameters, |cursor| {
            Ok(Request::SetTcpLoad {
                mass: cursor.f32()?,
                centre: cursor.floats()?,
            })
        })?,
        register::SET_COLLISION_SENSITIVITY => Request::SetCollisionSensitivity(byte("collision sensitivity")?),
        register::SET_TEACH_SENSITIVITY => Request::SetTeachSensitivity(byte("teach sensitivity")?),
        register::GET_JOINTS => whole("get joints", "0 or 1", parameters, |cursor| {
            Ok(Request::GetJoints {
                parts: optional(cursor, Cursor::u8)?,
            })
        })?,
        register::INVERSE_KINEMATICS => {
            // What follows, whether limits count and a reference, makes no difference to whether there is a solution.
            Request::InverseKinematics(Cursor::new("inverse kinematics", "24 or more", parameters).floats()?)
        }
        register::FORWARD_KINEMATICS => {
            Request::ForwardKinematics(whole("forward kinematics", "28", parameters, Cursor::floats)?)
        }
        register::JOINT_LIMIT_CHECK => {
            Request::JointLimitCheck(whole("limit check", "28", parameters, Cursor::floats)?)
        }
        register::TCP_LIMIT_CHECK => Request::TcpLimitCheck(whole("limit check", "24", parameters, Cursor::floats)?),
        register::SET_GRAVITY => Request::SetGravity(whole("gravity", "12", parameters, Cursor::floats)?),
        register::SET_WORLD_OFFSET => Request::SetWorldOffset(whole("world offset", "24", parameters, Cursor::floats)?),
        register::SELF_COLLISION_CHECK => Request::SelfCollisionCheck(byte("self-collision check")? != 0),
        register::TOOL_SHAPE => Request::ToolShape(parameters.to_vec()),
        register::SIMULATION => Request::Simulation(byte("simulation")? != 0),
        register::TOOL_WRITE => whole("tool write", "7 or 8", parameters, tool_write)?,
        register::TOOL_READ => whole("tool read", "3", parameters, |cursor| {
            tool_host(cursor)?;
            Ok(Request::ToolRead { address: cursor.u16()? })
        })?,
        register::SET_FEEDBACK => Request::SetFeedback(byte("feedback")?),
        _ => return Ok(None),
    }))
}

/// Reads all of the parameters; bytes left over are an error.
fn whole<'a, T>(
    what: &'static str,
    expected: &'static str,
    parameters: &'a [u8],
    read: impl FnOnce(&mut Cursor<'a>) -> Result<T, ProtocolError>,
) -> Result<T, ProtocolError> {
    let mut cursor = Cursor::new(what, expected, parameters);
    let value = read(&mut cursor)?;
    cursor.end()?;
    Ok(value)
}

fn optional<'a, T>(
    cursor: &mut Cursor<'a>,
    read: impl FnOnce(&mut Cursor<'a>) -> Result<T, ProtocolError>,
) -> Result<Option<T>, ProtocolError> {
    if cursor.is_empty() {
        return Ok(None);
    }
    read(cursor).map(Some)
}

fn line(parameters: &[u8]) -> Result<MoveLine, ProtocolError> {
    whole("move line", "36, 43 or 44", parameters, |cursor| {
        let (pose, [speed, acceleration, time]) = (cursor.floats()?, cursor.floats()?);
        let options = optional(cursor, line_options)?;
        Ok(MoveLine {
            pose,
            speed,
            acceleration,
            time,
            options,
        })
    })
}

fn line_options(cursor: &mut Cursor<'_>) -> Result<MoveLineOptions, ProtocolError> {
    Ok(MoveLineOptions {
        radius: cursor.f32()?,
        in_tool: cursor.flag()?,
        axis_angle: cursor.flag()?,
        check_only: cursor.flag()?,
        motion_type: optional(cursor, Cursor::u8)?,
    })
}

fn circle(parameters: &[u8]) -> Result<MoveCircle, ProtocolError> {
    whole("move circle", "64 or 67", parameters, |cursor| {
        let (through, to) = (cursor.floats()?, cursor.floats()?);
        let [speed, acceleration, time, percent] = cursor.floats()?;
        let options = optional(cursor, |cursor| {
            Ok(MoveCircleOptions {
                in_tool: cursor.flag()?,
                axis_angle: cursor.flag()?,
                check_only: cursor.flag()?,
            })
        })?;
        Ok(MoveCircle {
            through,
            to,
            speed,
            acceleration,
            time,
            percent,
            options,
        })
    })
}

/// Understood as the newer form with a radius.
fn old_blended_line(parameters: &[u8]) -> Result<MoveLine, ProtocolError> {
    whole("move line with radius", "40", parameters, |cursor| {
        let (pose, [speed, acceleration, time, radius]) = (cursor.floats()?, cursor.floats()?);
        let options = Some(MoveLineOptions {
            radius,
            in_tool: false,
            axis_angle: false,
            check_only: false,
            motion_type: None,
        });
        Ok(MoveLine {
            pose,
            speed,
            acceleration,
            time,
            options,
        })
    })
}

fn joint(parameters: &[u8], is_blended: bool) -> Result<MoveJoint, ProtocolError> {
    whole("move joint", "40 or 41", parameters, |cursor| {
        let (angles, [speed, acceleration, last]) = (cursor.floats()?, cursor.floats()?);
        Ok(MoveJoint {
            angles,
            speed,
            acceleration,
            radius: is_blended.then_some(last),
            time: if is_blended { 0.0 } else { last },
            check_only: optional(cursor, Cursor::flag)?,
        })
    })
}

fn tool_write(cursor: &mut Cursor<'_>) -> Result<Request, ProtocolError> {
    tool_host(cursor)?;
    Ok(Request::ToolWrite {
        address: cursor.u16()?,
        value: cursor.f32()?,
        in_queue: optional(cursor, Cursor::flag)?,
    })
}

fn tool_host(cursor: &mut Cursor<'_>) -> Result<(), ProtocolError> {
    match cursor.u8()? {
        TOOL_HOST => Ok(()),
        other => Err(ProtocolError::Value {
            what: "host of the tool board",
            found: other.into(),
            allowed: "9",
        }),
    }
}
