//! What a motion reaches, and what it may.

use std::fmt;

use serde::Serialize;
use trajectory::{Extremes, Planner};

use super::pick::Pick;

#[derive(Debug, Serialize)]
pub(super) struct Report {
    duration_s: f64,
    /// Name and duration of each part, in order.
    parts: Vec<(&'static str, f64)>,
    joints: Vec<JointReport>,
    tool_speed: Reached,
}

/// Over the whole motion, between samples as well.
#[derive(Debug, Serialize)]
struct JointReport {
    joint: usize,
    /// Smallest and largest, rad.
    position: [f64; 2],
    /// Rad.
    position_limits: [f64; 2],
    /// Rad/s.
    speed: Reached,
    /// Rad/s².
    acceleration: Reached,
    /// Rad/s³.
    jerk: Reached,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Reached {
    most: f64,
    limit: f64,
}

impl Report {
    pub(super) fn of(planner: &Planner<7>, pick: &Pick) -> anyhow::Result<Self> {
        let joint = |index: usize| {
            let found = extremes(pick, index);
            let limits = &planner.limits().joints[index];
            let reached = |most: f64, limit: f64| Reached { most, limit };
            JointReport {
                joint: index + 1,
                position: found.position,
                position_limits: [limits.lower, limits.upper],
                speed: reached(found.velocity, limits.velocity),
                acceleration: reached(found.acceleration, limits.acceleration),
                jerk: reached(found.jerk, limits.jerk),
            }
        };
        Ok(Self {
            duration_s: pick.trajectory.duration(),
            parts: pick.parts.iter().map(|part| (part.what, part.duration)).collect(),
            joints: (0..7).map(joint).collect(),
            tool_speed: Reached {
                most: planner.tool_speed(&pick.trajectory)?.reached,
                limit: planner.limits().tool_speed,
            },
        })
    }
}

/// Of one joint over all segments.
fn extremes(pick: &Pick, joint: usize) -> Extremes {
    let nothing = Extremes {
        position: [f64::INFINITY, f64::NEG_INFINITY],
        velocity: 0.0,
        acceleration: 0.0,
        jerk: 0.0,
    };
    let segments = pick.trajectory.segments().iter();
    segments.fold(nothing, |most, segment| {
        let found = segment.joints()[joint].extremes();
        Extremes {
            position: [
                most.position[0].min(found.position[0]),
                most.position[1].max(found.position[1]),
            ],
            velocity: most.velocity.max(found.velocity),
            acceleration: most.acceleration.max(found.acceleration),
            jerk: most.jerk.max(found.jerk),
        }
    })
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts: Vec<String> = self
            .parts
            .iter()
            .map(|(what, seconds)| format!("{what} {seconds:.2}"))
            .collect();
        writeln!(out, "{:.2} s: {}", self.duration_s, parts.join(", "))?;
        writeln!(
            out,
            "{:<6} {:>18} {:>18} {:>16} {:>18} {:>18}",
            "joint", "positions, rad", "limits", "speed, rad/s", "accel., rad/s^2", "jerk, rad/s^3"
        )?;
        for joint in &self.joints {
            let range = |[least, most]: [f64; 2]| format!("{least:+.3} to {most:+.3}");
            writeln!(
                out,
                "{:<6} {:>18} {:>18} {:>16} {:>18} {:>18}",
                format!("J{}", joint.joint),
                range(joint.position),
                range(joint.position_limits),
                joint.speed.to_string(),
                joint.acceleration.to_string(),
                joint.jerk.to_string(),
            )?;
        }
        writeln!(out, "tool   {} m/s", self.tool_speed)
    }
}

impl fmt::Display for Reached {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:.3} of {:.2}", self.most, self.limit)
    }
}
