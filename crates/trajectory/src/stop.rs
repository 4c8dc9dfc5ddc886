//! Stops from any state, as fast as acceleration and jerk allow.
//!
//! Each joint by itself: the acceleration is ramped to its deceleration, held there if the speed asks for it, and ramped
//! back to nothing. It changes from the first instant on, so that the first set-point after the call decelerates. Joints
//! do not wait for each other: the fastest stop leaves the path that they were on.

use crate::error::TrajectoryError;
use crate::limits::JointLimits;
use crate::quintic::State;

/// A part of constant jerk.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Part {
    duration: f64,
    jerk: f64,
    start: State,
}

/// How `N` joints come to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop<const N: usize> {
    joints: [[Part; 3]; N],
    duration: f64,
}

impl<const N: usize> Stop<N> {
    /// From these states on. Speeds beyond their limits are braked all the same; accelerations beyond theirs are first
    /// brought back.
    ///
    /// # Errors
    /// Numbers that are not finite, limits that cannot be.
    pub fn from(states: &[State; N], limits: &[JointLimits; N]) -> Result<Self, TrajectoryError> {
        let mut joints = [[Part::default(); 3]; N];
        for (index, (parts, (state, limits))) in joints.iter_mut().zip(states.iter().zip(limits)).enumerate() {
            limits.check(index + 1)?;
            state.require_finite(index + 1)?;
            *parts = brake(state, limits);
        }
        Ok(Self {
            duration: joints.iter().map(length).fold(0.0, f64::max),
            joints,
        })
    }

    /// Seconds until all joints rest.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// All joints at a time; after their ends they rest.
    pub fn sample(&self, time: f64) -> [State; N] {
        std::array::from_fn(|index| sample(&self.joints[index], time))
    }

    /// Where the joints come to rest.
    pub fn rest(&self) -> [f64; N] {
        self.sample(self.duration).map(|state| state.position)
    }

    /// The first joint that comes to rest outside its limits, which no faster stop could avoid, 1 for the first; none
    /// when all rest within them.
    pub fn overshoot(&self, limits: &[JointLimits; N]) -> Option<usize> {
        let is_out = |(position, limits): (f64, &JointLimits)| !(limits.lower..=limits.upper).contains(&position);
        let out = self.rest().into_iter().zip(limits).position(is_out)?;
        Some(out + 1)
    }
}

/// Three parts after which speed and acceleration are 0.
fn brake(state: &State, limits: &JointLimits) -> [Part; 3] {
    let jerk = limits.jerk;
    // The speed that would be left if the acceleration were just taken back; its sign says which way to brake.
    let left = state.velocity + state.acceleration * state.acceleration.abs() / (2.0 * jerk);
    let sign = if left < 0.0 { -1.0 } else { 1.0 };
    let (speed, push) = (sign * state.velocity, sign * state.acceleration);
    // v + a²/2j = p²/j + p t, with the deceleration p and the time t for which it is held.
    let to_take = (speed + push * push / (2.0 * jerk)).max(0.0);
    let without_hold = (jerk * to_take).sqrt();
    let peak = without_hold.min(limits.acceleration).max(-push).max(0.0);
    let hold = if peak > 0.0 {
        (to_take / peak - peak / jerk).max(0.0)
    } else {
        0.0
    };
    let ramps = [((push + peak) / jerk, -jerk), (hold, 0.0), (peak / jerk, jerk)];
    let mut start = *state;
    ramps.map(|(duration, jerk)| {
        let part = Part {
            duration: duration.max(0.0),
            jerk: sign * jerk,
            start,
        };
        start = part.at(part.duration);
        part
    })
}

impl Part {
    fn at(&self, time: f64) -> State {
        let State {
            position,
            velocity,
            acceleration,
        } = self.start;
        let jerk = self.jerk;
        State {
            position: position + time * (velocity + time * (acceleration / 2.0 + time * jerk / 6.0)),
            velocity: velocity + time * (acceleration + time * jerk / 2.0),
            acceleration: acceleration + time * jerk,
        }
    }
}

fn length(parts: &[Part; 3]) -> f64 {
    parts.iter().map(|part| part.duration).sum()
}

fn sample(parts: &[Part; 3], time: f64) -> State {
    if time >= length(parts) {
        // At rest to the last bit: what rounding left of speed and acceleration is dropped.
        return State::at(parts[2].at(parts[2].duration).position);
    }
    let mut left = time.max(0.0);
    for part in &parts[..2] {
        if left < part.duration {
            return part.at(left);
        }
        left -= part.duration;
    }
    parts[2].at(left)
}
