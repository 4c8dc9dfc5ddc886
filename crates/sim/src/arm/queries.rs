//! Requests that only ask.

use geometry::RigidTransform;
use xarm_protocol::{Request, State};

use super::answer::Outcome;
use super::core::Core;
use super::dynamics::holding_torques;
use super::model::Joints;
use super::units::{joints_of_wire, joints_to_wire, pose_of_wire, pose_to_wire};

/// Bytes of the serial numbers.
const SERIAL_NUMBERS: usize = 40;
/// Of one of them.
const SERIAL_NUMBER: usize = 14;
/// Of a serial number: series and generation.
const MODEL: usize = 6;

impl Core {
    pub(super) fn query(&mut self, request: &Request) -> Option<Outcome> {
        Some(match request {
            Request::Version => Outcome::Data(self.identity()),
            Request::SerialNumbers => Outcome::Data(self.serial_numbers()),
            Request::GetState => Outcome::Data(vec![self.reported_state().number()]),
            Request::GetQueued => Outcome::Data((self.planner.count() as u16).to_be_bytes().to_vec()),
            Request::GetError => Outcome::Data(vec![self.error, self.warning]),
            Request::GetTcpPose => Outcome::Floats(self.pose().into()),
            Request::GetJoints { parts } => Outcome::Floats(self.joint_values(*parts)),
            Request::GetJointTorques => Outcome::Floats(joints_to_wire(&self.torques()).into()),
            Request::GetCalibratedDh => Outcome::Floats(self.dimensions()),
            Request::ServoDebug => Outcome::Data(
                self.servo_codes()
                    .as_flattened()
                    .iter()
                    .copied()
                    .chain([0; 2])
                    .collect(),
            ),
            Request::InverseKinematics(pose) => self.inverse(pose),
            Request::ForwardKinematics(angles) => self.forward(angles),
            Request::JointLimitCheck(angles) => {
                let is_outside = self.model.outside(&joints_of_wire(angles)).is_some();
                Outcome::Data(vec![is_outside.into()])
            }
            Request::TcpLimitCheck(pose) => Outcome::Data(vec![self.reach(pose).is_none().into()]),
            Request::GetMovement => Outcome::Data(vec![u8::from(self.reported_state() == State::Moving)]),
            Request::BoxInputs => Outcome::Data(vec![0; 2]),
            _ => return None,
        })
    }

    /// With the beginnings of the serial numbers, as the hardware tells them: the vendor's client reads 40 bytes, which
    /// whole ones and a long version would not fit into.
    fn identity(&self) -> Vec<u8> {
        let mut told = self.config.identity.clone();
        for serial in [&mut told.arm_serial, &mut told.box_serial] {
            *serial = serial.chars().take(MODEL).collect();
        }
        told.encode()
    }

    fn serial_numbers(&self) -> Vec<u8> {
        let identity = &self.config.identity;
        let mut data = Vec::with_capacity(SERIAL_NUMBERS);
        for serial in [&identity.arm_serial, &identity.box_serial] {
            data.extend(serial.bytes());
            data.resize(data.len().max(SERIAL_NUMBER), b' ');
            data.push(0);
        }
        data.resize(SERIAL_NUMBERS, 0);
        data
    }

    /// Of the tool, as on the wire.
    pub(super) fn pose(&self) -> [f32; 6] {
        pose_to_wire(&self.base_from_tool())
    }

    /// Newton metres.
    pub(super) fn torques(&self) -> Joints {
        let cup = self.config.flange_from_cup.translation();
        let held = (self.tool.held().unwrap_or(0.0), [cup.x, cup.y, cup.z]);
        let loads = [self.settings.mounted(), held];
        holding_torques(&self.model, &self.angles(), &loads, &self.settings.down())
    }

    fn joint_values(&self, parts: Option<u8>) -> Vec<f32> {
        let parts = parts.filter(|_| self.firmware().has_joint_details());
        let parts = parts.map_or(1, |parts| parts & 0x0F);
        let values = [self.angles(), self.joints.map(|joint| joint.velocity), self.torques()];
        let values = values.iter().take(usize::from(parts.clamp(1, 3)));
        values.flat_map(joints_to_wire).collect()
    }

    /// theta, d, alpha, a of each joint; radians, millimetres.
    fn dimensions(&self) -> Vec<f32> {
        let rows = self.model.dimensions().iter();
        rows.flat_map(|row| [row.theta, row.d * 1e3, row.alpha, row.a * 1e3].map(|value| value as f32))
            .collect()
    }

    /// Status and code of each servo.
    pub(super) fn servo_codes(&self) -> [[u8; 2]; 7] {
        let mut codes = [[0; 2]; 7];
        // The joint that the error is about, with a large deviation of its position.
        if let Some(joint) = self.error.checked_sub(11).filter(|joint| *joint < 7) {
            codes[usize::from(joint)] = [3, 23];
        }
        codes
    }

    fn reach(&self, pose: &[f32; 6]) -> Option<Joints> {
        let flange: RigidTransform = pose_of_wire(pose) * self.settings.flange_from_tool().inverse();
        self.model.reach(&flange, &self.angles()).ok()
    }

    fn inverse(&self, pose: &[f32; 6]) -> Outcome {
        match self.reach(pose) {
            Some(angles) => Outcome::Floats(joints_to_wire(&angles).into()),
            None => Outcome::NoResult(vec![0.0; 7]),
        }
    }

    fn forward(&self, angles: &[f32; 7]) -> Outcome {
        if angles.iter().any(|angle| !angle.is_finite()) {
            return Outcome::Invalid;
        }
        let flange = self.model.flange(&joints_of_wire(angles));
        Outcome::Floats(pose_to_wire(&(flange * self.settings.flange_from_tool())).into())
    }
}
