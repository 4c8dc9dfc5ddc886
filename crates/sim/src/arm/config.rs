//! What is chosen before an arm starts.

use std::fmt::Debug;
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::sync::Arc;

use geometry::RigidTransform;
use geometry::nalgebra::{UnitQuaternion, Vector3};
use kinematics::ModifiedDh;
use xarm_protocol::{Firmware, Identity, ReportKind, VacuumHardware};

/// Mouth of the cup before the flange, metres.
const CUP: f64 = 0.126;

/// What the cup can take hold of.
pub trait SuctionWorld: Debug + Send + Sync {
    /// The mass (kilograms) of what a cup would hold whose mouth is at this pose, z out of it; none where its rim does
    /// not lie on a surface. Asked every 4 ms while the pump runs and nothing is held.
    fn touched(&self, base_from_cup: &RigidTransform) -> Option<f64>;

    /// The cup, at this pose, has taken hold of what it touches. Must not block.
    fn sealed(&self, _base_from_cup: &RigidTransform) {}

    /// The cup, at this pose, has let go of what it held. Must not block.
    fn released(&self, _base_from_cup: &RigidTransform) {}
}

/// How an arm is set up.
#[derive(Debug, Clone)]
pub struct ArmConfig {
    /// Where it is on the network.
    pub address: Ipv4Addr,
    /// Its ports; 0 takes any that is free.
    pub ports: ArmPorts,
    /// A Unix socket that answers like the control port. The vendor's Python client looks for
    /// `/tmp/xarmcontroller_uds_<port>` before it connects.
    pub socket: Option<PathBuf>,
    /// What it says of itself; joint limits and layouts follow from it.
    pub identity: Identity,
    /// How the vacuum gripper is wired.
    pub vacuum: VacuumHardware,
    /// The arm's own dimensions; none: the nominal ones.
    pub calibration: Option<[ModifiedDh; 7]>,
    /// At power on, radians.
    pub joints: [f64; 7],
    /// Mouth of the cup on the flange, whatever clients say of their tool.
    pub flange_from_cup: RigidTransform,
    /// What the cup can take hold of; none: nothing.
    pub suction: Option<Arc<dyn SuctionWorld>>,
}

/// TCP ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArmPorts {
    /// Requests and replies.
    pub control: u16,
    /// Normal reports, 5 Hz.
    pub normal: u16,
    /// Rich reports, 5 Hz.
    pub rich: u16,
    /// Real-time reports, 100 Hz.
    pub real: u16,
}

impl ArmPorts {
    /// Those of the hardware. The first needs privileges.
    pub const STANDARD: Self = Self {
        control: 502,
        normal: 30001,
        rich: 30002,
        real: 30003,
    };
    /// Any that are free.
    pub const ANY: Self = Self {
        control: 0,
        normal: 0,
        rich: 0,
        real: 0,
    };

    /// Of a kind of reports.
    pub fn of_reports(&self, kind: ReportKind) -> u16 {
        match kind {
            ReportKind::Normal => self.normal,
            ReportKind::Rich => self.rich,
            ReportKind::Real => self.real,
        }
    }
}

impl Default for ArmConfig {
    /// A recent xArm7 with the cup on it, over the table, at any free ports of this host.
    fn default() -> Self {
        Self {
            address: Ipv4Addr::LOCALHOST,
            ports: ArmPorts::ANY,
            socket: None,
            identity: Identity {
                axes: 7,
                robot_type: 7,
                arm_serial: "XI130506SIM001".into(),
                box_serial: "AC130501SIM001".into(),
                firmware: Firmware::new(2, 5, 5),
            },
            vacuum: VacuumHardware::Cable,
            calibration: None,
            joints: [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0],
            flange_from_cup: RigidTransform::from_parts(Vector3::new(0.0, 0.0, CUP), UnitQuaternion::identity()),
            suction: None,
        }
    }
}
