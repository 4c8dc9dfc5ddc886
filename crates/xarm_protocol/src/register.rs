//! Numbers of the registers: what a request is about.

/// Identity of arm, box and firmware.
pub const VERSION: u8 = 1;
/// Serial numbers.
pub const SERIAL_NUMBERS: u8 = 2;
/// Shut the box down.
pub const SYSTEM_CONTROL: u8 = 10;
/// Servos on and off.
pub const MOTION_ENABLE: u8 = 11;
/// Ready, pause, stop.
pub const SET_STATE: u8 = 12;
/// How the controller is.
pub const GET_STATE: u8 = 13;
/// Commands that wait.
pub const GET_QUEUED: u8 = 14;
/// Error and warning.
pub const GET_ERROR: u8 = 15;
/// Forget the error.
pub const CLEAN_ERROR: u8 = 16;
/// Forget the warning.
pub const CLEAN_WARNING: u8 = 17;
/// Brakes by hand.
pub const BRAKE: u8 = 18;
/// What is done with commands.
pub const SET_MODE: u8 = 19;
/// The tool along a line.
pub const MOVE_LINE: u8 = 21;
/// The same with a rounded corner.
pub const MOVE_LINE_BLENDED: u8 = 22;
/// Joints to angles.
pub const MOVE_JOINT: u8 = 23;
/// The same with a rounded corner.
pub const MOVE_JOINT_BLENDED: u8 = 24;
/// All joints to 0.
pub const GO_HOME: u8 = 25;
/// Wait in the queue.
pub const PAUSE_TIME: u8 = 26;
/// The tool along a circle.
pub const MOVE_CIRCLE: u8 = 27;
/// The next set-point of the joints.
pub const SERVO_JOINT: u8 = 29;
/// The next set-point of the tool.
pub const SERVO_CARTESIAN: u8 = 30;
/// Jerk of the tool.
pub const SET_TCP_JERK: u8 = 31;
/// Acceleration of the tool.
pub const SET_TCP_ACCELERATION: u8 = 32;
/// Jerk of the joints.
pub const SET_JOINT_JERK: u8 = 33;
/// Acceleration of the joints.
pub const SET_JOINT_ACCELERATION: u8 = 34;
/// The tool on the flange.
pub const SET_TCP_OFFSET: u8 = 35;
/// What hangs on the flange.
pub const SET_TCP_LOAD: u8 = 36;
/// Of the collision detection.
pub const SET_COLLISION_SENSITIVITY: u8 = 37;
/// Of leading by hand.
pub const SET_TEACH_SENSITIVITY: u8 = 38;
/// Back to the defaults.
pub const CLEAR_CONFIGURATION: u8 = 39;
/// Keep over power off.
pub const SAVE_CONFIGURATION: u8 = 40;
/// Pose of the tool.
pub const GET_TCP_POSE: u8 = 41;
/// Angles of the joints.
pub const GET_JOINTS: u8 = 42;
/// Angles for a pose.
pub const INVERSE_KINEMATICS: u8 = 43;
/// Pose for angles.
pub const FORWARD_KINEMATICS: u8 = 44;
/// Whether angles are outside the limits.
pub const JOINT_LIMIT_CHECK: u8 = 45;
/// Whether a pose is.
pub const TCP_LIMIT_CHECK: u8 = 46;
/// Which way is down.
pub const SET_GRAVITY: u8 = 51;
/// Torques of the joints.
pub const GET_JOINT_TORQUES: u8 = 55;
/// The arm's own dimensions.
pub const GET_CALIBRATED_DH: u8 = 67;
/// Whether the arm moves.
pub const GET_MOVEMENT: u8 = 69;
/// The base in the world.
pub const SET_WORLD_OFFSET: u8 = 73;
/// Whether the arm looks after itself.
pub const SELF_COLLISION_CHECK: u8 = 77;
/// What shape the tool has.
pub const TOOL_SHAPE: u8 = 78;
/// Move only virtually.
pub const SIMULATION: u8 = 79;
/// Velocities of the joints.
pub const JOINT_VELOCITY: u8 = 81;
/// Velocity of the tool.
pub const CARTESIAN_VELOCITY: u8 = 82;
/// Status and code of the servos.
pub const SERVO_DEBUG: u8 = 106;
/// Write to the tool board.
pub const TOOL_WRITE: u8 = 127;
/// Read from the tool board.
pub const TOOL_READ: u8 = 128;
/// Inputs of the control box.
pub const BOX_INPUTS: u8 = 131;
/// Tells when the queue is empty.
pub const QUEUE_MARKER: u8 = 253;
/// What is told by itself.
pub const SET_FEEDBACK: u8 = 254;
/// Stands for the register in what is told by itself.
pub const FEEDBACK: u8 = 255;
