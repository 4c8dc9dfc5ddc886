//! What a cycle asks for, and what it is told.

use std::time::Duration;

use geometry::RigidTransform;
use interfaces::geometry_msgs::msg::Pose;
use interfaces::rakelight_msgs::msg::Grasp;

use super::order::{Carried, Mode};

/// What is to be done. Each but [`Self::Interrupt`] and [`Self::Halt`] is answered by one event.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Command {
    Capture {
        cameras: Vec<String>,
    },
    Solve {
        capture_id: String,
    },
    Plan {
        capture_id: String,
        mode: Mode,
    },
    Move(Move),
    Vacuum {
        on: bool,
    },
    Home,
    /// Ends what runs, which still answers.
    Interrupt,
    /// Stops the arm whatever it does; nothing is answered.
    Halt,
}

/// A motion of the tool; `MoveTool.action` says what the fields mean.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Move {
    pub(crate) to: Pose,
    pub(crate) straight: bool,
    /// m/s; 0: as fast as is allowed.
    pub(crate) speed: f64,
    pub(crate) contact: bool,
    pub(crate) until_held: bool,
    pub(crate) carried: Option<Carried>,
    pub(crate) dry: Option<DryRun>,
}

/// Nothing moves.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct DryRun {
    /// Where the way would begin; empty: where the arm stands.
    pub(crate) start_joints: Vec<f64>,
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    Captured {
        capture_id: String,
    },
    Solved {
        cameras: Vec<String>,
        /// What was missing, for people; empty: nothing.
        message: String,
    },
    Planned(Planned),
    /// A motion came to its end, or would.
    Moved {
        held: bool,
        joints: Vec<f64>,
        duration: Duration,
    },
    /// The pump is as asked, or the arm at home.
    Done,
    /// What runs has failed.
    Failed(Fault),
    Arm(ArmReport),
    /// Somebody does not want the cycle any more.
    Cancel,
    /// Time has passed.
    Tick,
}

/// The planner's answer.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Planned {
    /// Best first; those without joint angles cannot be reached.
    pub(crate) grasps: Vec<Grasp>,
    /// The capture was looked at; otherwise no grasps means nothing.
    pub(crate) looked: bool,
    /// Why there are none, or what was missing.
    pub(crate) message: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Somebody answered that it cannot be, or did not go well.
    Refused(String),
    /// Nobody answered.
    Lost(String),
}

impl Fault {
    pub(crate) fn reason(&self) -> &str {
        match self {
            Self::Refused(reason) | Self::Lost(reason) => reason,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cup {
    Off,
    /// The pump runs, and nothing is held.
    On,
    Held,
}

/// How the arm is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArmReport {
    pub(crate) cup: Cup,
    /// `base_from_tcp`; none before anything was measured.
    pub(crate) tcp: Option<RigidTransform>,
    /// Why it cannot move until somebody does something about it.
    pub(crate) unfit: Option<String>,
}
