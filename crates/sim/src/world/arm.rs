//! The `arm:` of a world file.

use std::net::Ipv4Addr;

use geometry::RigidTransform;
use serde::Deserialize;
use xarm_protocol::{Firmware, VacuumHardware};

use super::Arm;
use crate::SimError;
use crate::arm::{ArmConfig, ArmPorts, flange_of, joints_for};

/// Beside the cameras'.
const ADDRESS: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 4);
/// The standard one, 502, needs privileges.
const CONTROL_PORT: u16 = 5020;

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct ArmFile {
    address: Option<Ipv4Addr>,
    control_port: Option<u16>,
    /// Normal, rich, real-time.
    report_ports: Option<[u16; 3]>,
    serial: Option<String>,
    firmware: Option<String>,
    vacuum: Option<u8>,
    joints: Option<[f64; 7]>,
    collisions: Collisions,
}

/// What the controller does when the arm hits something.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Collisions {
    /// Error 31, as the hardware does when its motors feel more than they should.
    #[default]
    Stop,
    /// Nothing; they are counted only.
    Count,
}

impl ArmFile {
    /// Where no joint angles are given, the arm holds its flange where it is to be.
    pub(super) fn resolve(&self, base_from_flange: &RigidTransform) -> Result<Arm, SimError> {
        let defaults = ArmConfig::default();
        let mut arm = Arm {
            address: self.address.unwrap_or(ADDRESS),
            ports: self.ports(),
            serial: self.serial.clone().unwrap_or(defaults.identity.arm_serial),
            firmware: self.firmware(defaults.identity.firmware)?,
            vacuum: self.vacuum()?,
            joints: self.joints.unwrap_or(defaults.joints),
            collisions: self.collisions,
        };
        let place = |reason: crate::arm::ArmError| {
            let joints = format!("{:?}", self.joints.unwrap_or_default());
            SimError::value("joints", format!("{joints} ({reason})"), "angles that the arm can have")
        };
        if self.joints.is_none() {
            arm.joints = joints_for(&arm.config(), base_from_flange).map_err(|reason| {
                SimError::value("joints", format!("not given, and {reason}"), "a `flange` within reach")
            })?;
        }
        flange_of(&arm.config()).map_err(place)?;
        Ok(arm)
    }

    fn ports(&self) -> ArmPorts {
        let standard = ArmPorts::STANDARD;
        let [normal, rich, real] = self
            .report_ports
            .unwrap_or([standard.normal, standard.rich, standard.real]);
        ArmPorts {
            control: self.control_port.unwrap_or(CONTROL_PORT),
            normal,
            rich,
            real,
        }
    }

    fn firmware(&self, default: Firmware) -> Result<Firmware, SimError> {
        let Some(text) = &self.firmware else {
            return Ok(default);
        };
        let read = text.parse::<Firmware>().and_then(Firmware::require_supported);
        read.map_err(|reason| SimError::value("firmware", format!("{text} ({reason})"), "such as v2.5.5"))
    }

    fn vacuum(&self) -> Result<VacuumHardware, SimError> {
        let version = self.vacuum.unwrap_or(1);
        let refuse = || SimError::value("vacuum", version.to_string(), "1 or 2");
        VacuumHardware::of_version(version).ok_or_else(refuse)
    }
}

impl Arm {
    /// For its controller.
    pub fn config(&self) -> ArmConfig {
        let mut config = ArmConfig {
            address: self.address,
            ports: self.ports,
            vacuum: self.vacuum,
            joints: self.joints,
            ..ArmConfig::default()
        };
        config.identity.arm_serial.clone_from(&self.serial);
        config.identity.firmware = self.firmware;
        config
    }
}
