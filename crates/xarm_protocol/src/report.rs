//! Reports: what the controller sends on ports 30001 to 30003 without being asked.

mod decode;
mod encode;
mod reader;

pub use reader::ReportReader;

use crate::firmware::Firmware;
use crate::modes::{Mode, State};

/// Which port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReportKind {
    /// 30001, 5 Hz: with errors and settings.
    Normal,
    /// 30002, 5 Hz: with everything.
    Rich,
    /// 30003, 100 Hz: joints, pose, torques.
    Real,
}

/// Lengths of the rich report, each with the part that came with it; a controller sends any of them, always the same.
pub(crate) const RICH_LENGTHS: [usize; 10] = [245, 252, 284, 314, 341, 383, 433, 494, 574, 587];
/// Without and with forces.
pub(crate) const REAL_LENGTHS: [usize; 2] = [87, 135];
pub(crate) const NORMAL_LENGTH: usize = 145;
/// Old firmware wrote this length and sent 145 bytes.
pub(crate) const NORMAL_MISTAKE: usize = 133;
/// Old firmware wrote this length and sent 245 bytes.
pub(crate) const RICH_MISTAKE: usize = 233;

impl ReportKind {
    /// Standard port.
    pub fn port(self) -> u16 {
        match self {
            Self::Normal => 30001,
            Self::Rich => 30002,
            Self::Real => 30003,
        }
    }

    /// Reports in a second.
    pub fn rate(self) -> u32 {
        match self {
            Self::Normal | Self::Rich => 5,
            Self::Real => 100,
        }
    }

    /// Bytes of a report of this firmware, without forces.
    pub fn length(self, firmware: Firmware) -> usize {
        match self {
            Self::Normal => NORMAL_LENGTH,
            Self::Rich => firmware.rich_report_length(),
            Self::Real => REAL_LENGTHS[0],
        }
    }

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Rich => "rich",
            Self::Real => "real-time",
        }
    }
}

/// A report. What its kind or length does not hold is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// What is done with commands.
    pub mode: Mode,
    /// How the controller is.
    pub state: State,
    /// Commands that wait.
    pub queued: u16,
    /// Radians.
    pub joints: [f32; 7],
    /// Of the tool in the base: millimetres; roll, pitch, yaw in radians.
    pub pose: [f32; 6],
    /// Newton metres (or amperes, see [`Details::flags`]).
    pub torques: [f32; 7],
    /// On the tool, external and raw, newtons and newton metres: real-time reports of arms with a force sensor.
    pub forces: Option<[[f32; 6]; 2]>,
    /// Normal and rich reports.
    pub condition: Option<Condition>,
    /// Rich reports.
    pub details: Option<Details>,
}

/// Errors and settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// A bit for each axis whose brake is open.
    pub brakes: u8,
    /// A bit for each axis whose servo is on.
    pub enabled: u8,
    /// 0 for none; see [`controller_error`](crate::controller_error).
    pub error: u8,
    /// 0 for none; see [`warning`](crate::warning).
    pub warning: u8,
    /// The tool on the flange: millimetres, radians.
    pub tcp_offset: [f32; 6],
    /// Kilograms, then its centre in millimetres.
    pub load: [f32; 4],
    /// 0 (off) to 5.
    pub collision_sensitivity: u8,
    /// 0 to 5.
    pub teach_sensitivity: u8,
    /// Which way is down.
    pub gravity: [f32; 3],
}

/// Everything else that this crate gives a meaning to.
#[derive(Debug, Clone, PartialEq)]
pub struct Details {
    /// 7 is the present xArm7.
    pub robot_type: u8,
    /// Joints.
    pub axes: u8,
    /// As the controller tells it.
    pub version: String,
    /// Jerk, smallest and largest acceleration, smallest and largest speed of the tool (mm).
    pub tcp_motion: [f32; 5],
    /// The same of the joints (rad).
    pub joint_motion: [f32; 5],
    /// Jerk and largest acceleration of the tool's rotation (rad).
    pub rotation_motion: [f32; 2],
    /// Status and code of each servo; see [`servo_error`](crate::servo_error).
    pub servos: [[u8; 2]; 7],
    /// Status and code of the tool board.
    pub tool_board: [u8; 2],
    /// Of the joints, degrees Celsius; reports from 252 bytes on.
    pub temperatures: Option<[i8; 7]>,
    /// Of the tool (mm/s), then of the joints (rad/s); reports from 284 bytes on.
    pub speeds: Option<(f32, [f32; 7])>,
    /// Reports of 383 bytes and more: volts and amperes of the joints.
    pub power: Option<([f32; 7], [f32; 7])>,
    /// Reports from 494 bytes on: bit 0 reduced mode, 1 fence, 2 currents instead of torques, 3 approximate motion,
    /// 4 continuous joints.
    pub flags: Option<u8>,
}
