//! What a client can ask for.

use crate::frame::{Frame, Protocol};
use crate::modes::{Mode, StateCommand};

/// A coordinate of a line that is to stay as it is (firmware 2.4.101 and later).
pub const KEEP: f32 = f32::INFINITY;

/// A request with its parameters. Angles are radians, lengths millimetres; speeds per second, accelerations per second
/// squared.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Request {
    /// Who is there.
    Version,
    /// Of arm and box.
    SerialNumbers,
    /// Servos of one axis (1 to 7) or of all (8).
    MotionEnable {
        /// 1 to 7, or 8 for all.
        axis: u8,
        /// On or off.
        on: bool,
    },
    /// Run, pause, stop.
    SetState(StateCommand),
    /// How the controller is.
    GetState,
    /// Commands that wait.
    GetQueued,
    /// Error and warning.
    GetError,
    /// Forget the error.
    CleanError,
    /// Forget the warning.
    CleanWarning,
    /// What is done with commands.
    SetMode(Mode),
    /// The tool along a line.
    MoveLine(MoveLine),
    /// Joints to angles.
    MoveJoint(MoveJoint),
    /// The tool along a circle.
    MoveCircle(MoveCircle),
    /// All joints to 0.
    GoHome {
        /// rad/s.
        speed: f32,
        /// rad/s².
        acceleration: f32,
    },
    /// Wait in the queue, seconds.
    PauseTime(f32),
    /// The next set-point of the joints.
    ServoJoint {
        /// Radians.
        angles: [f32; 7],
        /// Not looked at by the controller.
        speed: f32,
        /// Not looked at by the controller.
        acceleration: f32,
        /// Not looked at by the controller.
        time: f32,
    },
    /// The next set-point of the tool.
    ServoCartesian {
        /// Millimetres, radians.
        pose: [f32; 6],
        /// In the tool's frame instead of the base's.
        in_tool: bool,
    },
    /// mm/s³.
    SetTcpJerk(f32),
    /// mm/s².
    SetTcpAcceleration(f32),
    /// rad/s³.
    SetJointJerk(f32),
    /// rad/s².
    SetJointAcceleration(f32),
    /// The tool on the flange; millimetres, radians.
    SetTcpOffset([f32; 6]),
    /// What hangs on the flange.
    SetTcpLoad {
        /// Kilograms.
        mass: f32,
        /// Its centre, millimetres.
        centre: [f32; 3],
    },
    /// 0 (off) to 5.
    SetCollisionSensitivity(u8),
    /// 0 to 5.
    SetTeachSensitivity(u8),
    /// Back to the defaults.
    ClearConfiguration,
    /// Keep over power off.
    SaveConfiguration,
    /// Pose of the tool.
    GetTcpPose,
    /// Angles of the joints; with a number of parts also velocities (2) and efforts (3).
    GetJoints {
        /// None: angles only, as old firmware answers.
        parts: Option<u8>,
    },
    /// Angles for a pose.
    InverseKinematics([f32; 6]),
    /// Pose for angles.
    ForwardKinematics([f32; 7]),
    /// Whether angles are outside the limits.
    JointLimitCheck([f32; 7]),
    /// Whether a pose is.
    TcpLimitCheck([f32; 6]),
    /// Which way is down, in the base's frame.
    SetGravity([f32; 3]),
    /// The base in the world; millimetres, radians.
    SetWorldOffset([f32; 6]),
    /// Whether the arm looks after itself.
    SelfCollisionCheck(bool),
    /// What shape the tool has; dimensions follow for some.
    ToolShape(Vec<u8>),
    /// Move only virtually.
    Simulation(bool),
    /// Whether the arm moves.
    GetMovement,
    /// Inputs of the control box.
    BoxInputs,
    /// Torques of the joints, Nm.
    GetJointTorques,
    /// The arm's own dimensions.
    GetCalibratedDh,
    /// Velocities of the joints.
    JointVelocity {
        /// rad/s.
        velocities: [f32; 7],
        /// All joints take as long as the slowest.
        synchronous: bool,
        /// Seconds until they end by themselves; none or 0: never.
        duration: Option<f32>,
    },
    /// Velocity of the tool.
    CartesianVelocity {
        /// mm/s, rad/s.
        velocity: [f32; 6],
        /// In the tool's frame instead of the base's.
        in_tool: bool,
        /// Seconds until it ends by itself; none or 0: never.
        duration: Option<f32>,
    },
    /// Status and code of the servos.
    ServoDebug,
    /// Write to the tool board.
    ToolWrite {
        /// See [`tool_address`](crate::tool_address).
        address: u16,
        /// As the register takes it.
        value: f32,
        /// Whether it waits for the motion queue; none: as old firmware is asked.
        in_queue: Option<bool>,
    },
    /// Read from the tool board.
    ToolRead {
        /// See [`tool_address`](crate::tool_address).
        address: u16,
    },
    /// Tell when the queue is empty.
    QueueMarker,
    /// What is told by itself: bits start 1, end 2, triggered 4.
    SetFeedback(u8),
    /// What this crate gives no meaning to.
    Unknown {
        /// Its number.
        register: u8,
        /// As they came.
        parameters: Vec<u8>,
    },
}

/// The tool along a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoveLine {
    /// x, y, z (mm), roll, pitch, yaw (rad); [`KEEP`] for what stays.
    pub pose: [f32; 6],
    /// mm/s.
    pub speed: f32,
    /// mm/s².
    pub acceleration: f32,
    /// Not looked at.
    pub time: f32,
    /// None for the short form of old firmware.
    pub options: Option<MoveLineOptions>,
}

/// What newer firmware takes with a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoveLineOptions {
    /// Of the rounded corner, mm; negative for none.
    pub radius: f32,
    /// In the tool's frame instead of the base's.
    pub in_tool: bool,
    /// The last three numbers are an axis-angle vector.
    pub axis_angle: bool,
    /// Only tell whether it could be done.
    pub check_only: bool,
    /// Linear, or joint motion where a line is impossible; newest firmware only.
    pub motion_type: Option<u8>,
}

/// The tool along a circle that begins where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoveCircle {
    /// A pose on the circle; millimetres, radians.
    pub through: [f32; 6],
    /// Another one, after it.
    pub to: [f32; 6],
    /// mm/s.
    pub speed: f32,
    /// mm/s².
    pub acceleration: f32,
    /// Not looked at.
    pub time: f32,
    /// Of the whole circle, 100 for once round.
    pub percent: f32,
    /// Newer firmware only.
    pub options: Option<MoveCircleOptions>,
}

/// What newer firmware takes with a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoveCircleOptions {
    /// In the tool's frame instead of the base's.
    pub in_tool: bool,
    /// The last three numbers are an axis-angle vector.
    pub axis_angle: bool,
    /// Only tell whether it could be done.
    pub check_only: bool,
}

/// Joints to angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MoveJoint {
    /// Radians.
    pub angles: [f32; 7],
    /// rad/s.
    pub speed: f32,
    /// rad/s².
    pub acceleration: f32,
    /// Of the rounded corner, degrees of arc; none for a full stop.
    pub radius: Option<f32>,
    /// Not looked at.
    pub time: f32,
    /// Only tell whether it could be done.
    pub check_only: Option<bool>,
}

impl Request {
    /// As a frame.
    pub fn frame(&self, transaction: u16, protocol: Protocol) -> Frame {
        let mut body = vec![self.register()];
        self.put_parameters(&mut body);
        Frame {
            transaction,
            protocol,
            body,
        }
    }
}
