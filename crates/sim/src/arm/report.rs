//! What the controller tells of itself without being asked.

use xarm_protocol::Report;
use xarm_protocol::report::{Condition, Details};

use super::core::Core;
use super::units::joints_to_wire;

/// Of joints and tool: smallest acceleration, smallest and largest speed (mm or rad).
const TCP_RANGE: [f32; 3] = [1.0, 0.1, 1000.0];
const JOINT_RANGE: [f32; 3] = [0.01, 0.001, std::f32::consts::PI];
/// Jerk and acceleration of the tool's rotation, rad.
const ROTATION: [f32; 2] = [2.3, 4.5];
/// Of the motors: degrees Celsius, volts, amperes.
const TEMPERATURE: i8 = 31;
const VOLTAGE: f32 = 48.0;
const CURRENT: f32 = 0.25;

impl Core {
    pub(super) fn report(&self) -> Report {
        Report {
            mode: self.mode,
            state: self.reported_state(),
            queued: self.planner.count() as u16,
            joints: joints_to_wire(&self.angles()),
            pose: self.pose(),
            torques: joints_to_wire(&self.torques()),
            forces: None,
            condition: Some(self.condition()),
            details: Some(self.details()),
        }
    }

    fn condition(&self) -> Condition {
        let settings = &self.settings;
        Condition {
            // Brakes open when motors hold.
            brakes: self.enabled,
            enabled: self.enabled,
            error: self.error,
            warning: self.warning,
            tcp_offset: settings.tcp_offset,
            load: settings.load,
            collision_sensitivity: settings.collision_sensitivity,
            teach_sensitivity: settings.teach_sensitivity,
            gravity: settings.gravity,
        }
    }

    fn details(&self) -> Details {
        let (identity, settings) = (&self.config.identity, &self.settings);
        let [tcp_least, tcp_slowest, tcp_fastest] = TCP_RANGE;
        let [joint_least, joint_slowest, joint_fastest] = JOINT_RANGE;
        Details {
            robot_type: identity.robot_type,
            axes: identity.axes,
            version: identity.firmware.to_string(),
            tcp_motion: [
                settings.tcp_jerk,
                tcp_least,
                settings.tcp_acceleration,
                tcp_slowest,
                tcp_fastest,
            ],
            joint_motion: [
                settings.joint_jerk,
                joint_least,
                settings.joint_acceleration,
                joint_slowest,
                joint_fastest,
            ],
            rotation_motion: ROTATION,
            servos: self.servo_codes(),
            tool_board: [0; 2],
            temperatures: Some([TEMPERATURE; 7]),
            speeds: Some((
                (self.tool_speed * 1e3) as f32,
                self.joints.map(|joint| joint.velocity as f32),
            )),
            power: Some(([VOLTAGE; 7], [CURRENT; 7])),
            flags: Some(0),
        }
    }
}
