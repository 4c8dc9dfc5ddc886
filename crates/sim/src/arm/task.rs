//! What waits in the controller's queue.

use geometry::RigidTransform;
use xarm_protocol::Protocol;

use super::model::Joints;

/// Who asked, and what they want to be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Ticket {
    /// Number of the client; 0 for nobody.
    pub(super) client: u64,
    pub(super) transaction: u16,
    pub(super) protocol: Protocol,
    pub(super) register: u8,
    /// Bits: start 1, end 2, triggered 4.
    pub(super) feedback: u8,
    /// Number of the command.
    pub(super) task: u16,
}

/// A command in the queue.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Task {
    pub(super) ticket: Ticket,
    pub(super) action: Action,
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Action {
    Move(Move),
    /// Seconds.
    Pause(f64),
    /// Mask and bits.
    Outputs(u16),
    /// On the flange: kilograms, millimetres.
    Load([f32; 4]),
    /// Nothing but to tell that all before it is done.
    Marker,
}

/// A motion whose start is not known yet.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Move {
    pub(super) goal: Goal,
    /// rad/s or m/s.
    pub(super) speed: f64,
    /// Per second squared.
    pub(super) acceleration: f64,
    /// Radians or metres of the rounded corner.
    pub(super) blend: Option<f64>,
}

/// Where it goes.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Goal {
    Joints(Joints),
    Line(Pose),
    /// Through the first to the second; then on for this share of the circle.
    Circle {
        through: Pose,
        to: Pose,
        share: f64,
    },
}

/// A pose of the tool as a command gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    /// Millimetres, radians; infinite for what stays.
    pub(super) numbers: [f32; 6],
    pub(super) axis_angle: bool,
    /// In the frame of the tool where the motion begins.
    pub(super) in_tool: bool,
}

impl Pose {
    /// In the base, for a motion that begins at `base_from_start`.
    pub(super) fn resolve(&self, base_from_start: &RigidTransform) -> RigidTransform {
        let start = if self.in_tool {
            RigidTransform::identity()
        } else {
            *base_from_start
        };
        let kept = if self.axis_angle {
            let (place, turn) = (start.translation() * 1e3, start.rotation().scaled_axis());
            [place.x, place.y, place.z, turn.x, turn.y, turn.z].map(|value| value as f32)
        } else {
            super::units::pose_to_wire(&start)
        };
        let numbers: [f32; 6] = std::array::from_fn(|index| {
            let number = self.numbers[index];
            if number.is_infinite() { kept[index] } else { number }
        });
        let pose = if self.axis_angle {
            super::units::axis_angle_of_wire(&numbers)
        } else {
            super::units::pose_of_wire(&numbers)
        };
        if self.in_tool { *base_from_start * pose } else { pose }
    }
}
