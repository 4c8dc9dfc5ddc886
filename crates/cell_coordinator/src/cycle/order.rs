//! What a cycle is to do, and how.

use std::time::Duration;

use geometry::nalgebra::{Point3, Vector3};

use super::stage::Stage;

/// What kind of object is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    /// A body.
    Solid,
    /// A sheet or card.
    Thin,
}

/// What hangs on the cup: a cylinder about the tool's z axis, from the lip outwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Carried {
    /// Metres.
    pub(crate) radius: f64,
    /// Metres.
    pub(crate) length: f64,
}

/// One cycle, and how the cell stands when it begins.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Order {
    /// Looked for in this order; at least one.
    pub(crate) modes: Vec<Mode>,
    /// Name of a known object; empty: whatever can be picked.
    pub(crate) target: String,
    /// In which the cup is to come, base frame, any length; 0: free choice.
    pub(crate) direction: Vector3<f64>,
    /// Nothing moves.
    pub(crate) dry_run: bool,
    /// Cameras of the cell.
    pub(crate) cameras: Vec<String>,
    /// The arm stands where captures are taken from.
    pub(crate) at_home: bool,
    /// What the cup holds.
    pub(crate) held: Option<Carried>,
}

/// How cycles are done.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Policy {
    /// How often the arm may try, at least 1.
    pub(crate) attempts: u32,
    /// A second capture shows whether the object is gone.
    pub(crate) verify: bool,
    /// How far the approach goes on behind the contact, metres.
    pub(crate) overtravel: f64,
    /// Of the approach, m/s.
    pub(crate) approach_speed: f64,
    /// What hangs on the cup when nobody knows.
    pub(crate) carried: Carried,
    /// Where objects go.
    pub(crate) bin: Bin,
    /// How far up an object is lifted that the cup holds at the beginning, metres.
    pub(crate) lift: f64,
    /// A leg that would take longer is refused.
    pub(crate) longest_leg: Duration,
    pub(crate) limits: Limits,
}

/// The bin: its floor's middle in the base frame, and how high things are held over it, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bin {
    pub(crate) position: Point3<f64>,
    /// Of the walls' upper edge over `position`.
    pub(crate) rim: f64,
    /// Between the rim and the lower end of what is carried.
    pub(crate) clearance: f64,
}

/// How long things may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    pub(crate) capture: Duration,
    pub(crate) solve: Duration,
    pub(crate) plan: Duration,
    pub(crate) execute: Duration,
    /// From switching the pump off until the cup holds nothing.
    pub(crate) release: Duration,
    /// From being told to end until it has.
    pub(crate) interrupt: Duration,
}

impl Limits {
    pub(crate) fn of(&self, stage: Stage) -> Duration {
        match stage {
            Stage::Capture => self.capture,
            Stage::Solve => self.solve,
            Stage::Plan => self.plan,
            Stage::Execute => self.execute,
        }
    }
}
