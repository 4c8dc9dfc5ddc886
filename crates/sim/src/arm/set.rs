//! Requests that set what the controller keeps.

use xarm_protocol::Request;

use super::answer::Outcome;
use super::core::Core;
use super::settings::Settings;

/// Sensitivities end here.
const MOST_SENSITIVE: u8 = 5;
/// Largest accelerations: mm/s², rad/s².
const TCP_ACCELERATIONS: std::ops::RangeInclusive<f32> = 1.0..=50_000.0;
const JOINT_ACCELERATIONS: std::ops::RangeInclusive<f32> = 0.01..=20.0;
const JERKS: std::ops::RangeInclusive<f32> = 0.01..=1e6;

impl Core {
    pub(super) fn set(&mut self, request: &Request) -> Option<Outcome> {
        let settings = &mut self.settings;
        let is_valid = match request {
            Request::SetTcpOffset(offset) => assign_finite(&mut settings.tcp_offset, offset),
            Request::SetGravity(direction) => assign_finite(&mut settings.gravity, direction),
            Request::SetWorldOffset(offset) => assign_finite(&mut settings.world_offset, offset),
            Request::SetCollisionSensitivity(value) => assign_sensitivity(&mut settings.collision_sensitivity, *value),
            Request::SetTeachSensitivity(value) => assign_sensitivity(&mut settings.teach_sensitivity, *value),
            _ => return self.set_silently(request),
        };
        Some(if is_valid { self.changed() } else { Outcome::Invalid })
    }

    /// What does not ask to be set ready again.
    fn set_silently(&mut self, request: &Request) -> Option<Outcome> {
        let settings = &mut self.settings;
        let is_valid = match request {
            Request::SetTcpJerk(value) => assign_within(&mut settings.tcp_jerk, *value, &JERKS),
            Request::SetTcpAcceleration(value) => {
                assign_within(&mut settings.tcp_acceleration, *value, &TCP_ACCELERATIONS)
            }
            Request::SetJointJerk(value) => assign_within(&mut settings.joint_jerk, *value, &JERKS),
            Request::SetJointAcceleration(value) => {
                assign_within(&mut settings.joint_acceleration, *value, &JOINT_ACCELERATIONS)
            }
            Request::SelfCollisionCheck(on) => {
                settings.checks_self_collision = *on;
                true
            }
            Request::ClearConfiguration => {
                *settings = Settings::default();
                true
            }
            // Everything is kept until the arm is switched off; the tool's shape is that of the cup.
            Request::SaveConfiguration | Request::ToolShape(_) | Request::Simulation(_) => true,
            _ => return None,
        };
        Some(if is_valid { Outcome::Done } else { Outcome::Invalid })
    }
}

fn assign_finite<const N: usize>(place: &mut [f32; N], values: &[f32; N]) -> bool {
    let is_valid = values.iter().all(|value| value.is_finite());
    if is_valid {
        *place = *values;
    }
    is_valid
}

fn assign_sensitivity(place: &mut u8, value: u8) -> bool {
    let is_valid = value <= MOST_SENSITIVE;
    if is_valid {
        *place = value;
    }
    is_valid
}

fn assign_within(place: &mut f32, value: f32, allowed: &std::ops::RangeInclusive<f32>) -> bool {
    let is_valid = allowed.contains(&value);
    if is_valid {
        *place = value;
    }
    is_valid
}
