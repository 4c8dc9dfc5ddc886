//! Reports to bytes, for controllers.

use crate::bytes::put_floats;
use crate::report::{Condition, Details, REAL_LENGTHS, Report, ReportKind};

const VERSION: usize = 30;

impl Report {
    /// As bytes of a kind and length; what the report does not hold is 0. For a rich report the length is one of those
    /// that the firmware has ([`Firmware::rich_report_length`](crate::Firmware::rich_report_length)).
    pub fn encode(&self, kind: ReportKind, length: usize) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(length);
        bytes.extend((length as u32).to_be_bytes());
        bytes.push(self.mode.number() << 4 | self.state.number());
        bytes.extend(self.queued.to_be_bytes());
        put_floats(&mut bytes, &self.joints);
        put_floats(&mut bytes, &self.pose);
        put_floats(&mut bytes, &self.torques);
        match kind {
            ReportKind::Real if length > REAL_LENGTHS[0] => {
                let forces = self.forces.unwrap_or_default();
                put_floats(&mut bytes, forces.as_flattened());
            }
            ReportKind::Real => {}
            ReportKind::Normal | ReportKind::Rich => {
                if let Some(condition) = &self.condition {
                    put_condition(&mut bytes, condition);
                }
            }
        }
        if let (ReportKind::Rich, Some(details)) = (kind, &self.details) {
            put_details(&mut bytes, details);
        }
        bytes.resize(length, 0);
        bytes
    }
}

fn put_condition(bytes: &mut Vec<u8>, condition: &Condition) {
    bytes.extend([condition.brakes, condition.enabled, condition.error, condition.warning]);
    put_floats(bytes, &condition.tcp_offset);
    put_floats(bytes, &condition.load);
    bytes.extend([condition.collision_sensitivity, condition.teach_sensitivity]);
    put_floats(bytes, &condition.gravity);
}

fn put_details(bytes: &mut Vec<u8>, details: &Details) {
    bytes.extend([details.robot_type, details.axes, 0, 0, 0, 0]);
    let mut version = details.version.clone().into_bytes();
    version.resize(VERSION, 0);
    bytes.extend(version);
    put_floats(bytes, &details.tcp_motion);
    put_floats(bytes, &details.joint_motion);
    put_floats(bytes, &details.rotation_motion);
    bytes.extend(details.servos.as_flattened());
    bytes.extend(details.tool_board);
    bytes.extend(details.temperatures.unwrap_or_default().map(i8::cast_unsigned));
    let (tool, joints) = details.speeds.unwrap_or_default();
    put_floats(bytes, &[tool]);
    put_floats(bytes, &joints);
    // Counter, world offset, output resets; simulation and tool shape.
    bytes.resize(bytes.len() + 30 + 27, 0);
    let (voltages, currents) = details.power.unwrap_or_default();
    for voltage in voltages {
        bytes.extend(((voltage * 100.0).round() as u16).to_be_bytes());
    }
    put_floats(bytes, &currents);
    // Inputs and outputs of the box; forces and their axis.
    bytes.resize(bytes.len() + 50 + 61, 0);
    bytes.push(details.flags.unwrap_or_default());
}
