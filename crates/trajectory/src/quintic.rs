//! One joint's polynomial of fifth degree.

use crate::error::TrajectoryError;
use crate::roots::{Few, roots, value};

/// Position, speed and acceleration of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Radians or metres.
    pub position: f64,
    /// Per second.
    pub velocity: f64,
    /// Per second squared.
    pub acceleration: f64,
}

/// What a polynomial reaches over its duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Smallest and largest position.
    pub position: [f64; 2],
    /// Largest speed.
    pub velocity: f64,
    /// Largest acceleration, either way.
    pub acceleration: f64,
    /// Largest jerk, either way.
    pub jerk: f64,
}

/// A polynomial of fifth degree in time from 0 to its duration: of all motions between two states the one of least
/// squared jerk (Flash and Hogan 1985, appendix A).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quintic {
    /// Of the powers of time, constant first.
    coefficients: [f64; 6],
    duration: f64,
}

impl State {
    /// At rest.
    pub fn at(position: f64) -> Self {
        Self {
            position,
            ..Self::default()
        }
    }

    pub(crate) fn require_finite(&self, joint: usize) -> Result<(), TrajectoryError> {
        let numbers = [
            ("position", self.position),
            ("velocity", self.velocity),
            ("acceleration", self.acceleration),
        ];
        match numbers.into_iter().find(|(_, value)| !value.is_finite()) {
            None => Ok(()),
            Some((what, value)) => Err(TrajectoryError::NotFinite { joint, what, value }),
        }
    }
}

impl Quintic {
    /// From one state to another in `duration` seconds, more than 0.
    pub fn between(from: State, to: State, duration: f64) -> Self {
        let t = duration;
        let (v0, v1) = (from.velocity * t, to.velocity * t);
        let (a0, a1) = (from.acceleration * t * t, to.acceleration * t * t);
        let way = to.position - from.position;
        let third = 10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
        let fourth = -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
        let fifth = 6.0 * way - 3.0 * (v0 + v1) - 0.5 * (a0 - a1);
        Self {
            coefficients: [
                from.position,
                from.velocity,
                from.acceleration / 2.0,
                third / t.powi(3),
                fourth / t.powi(4),
                fifth / t.powi(5),
            ],
            duration,
        }
    }

    /// Seconds.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// At a time; before its begin and after its end it holds the states there.
    pub fn sample(&self, time: f64) -> State {
        let time = time.clamp(0.0, self.duration);
        State {
            position: value(&self.coefficients, time),
            velocity: value(&self.velocity(), time),
            acceleration: value(&self.acceleration(), time),
        }
    }

    /// Jerk at a time, per second cubed; before the begin and after the end that at the begin and the end.
    pub fn jerk_at(&self, time: f64) -> f64 {
        value(&self.jerk(), time.clamp(0.0, self.duration))
    }

    /// The same way in `factor` times the time, more than 0.
    #[must_use]
    pub fn slowed(&self, factor: f64) -> Self {
        let mut power = 1.0;
        Self {
            coefficients: self.coefficients.map(|coefficient| {
                let slowed = coefficient / power;
                power *= factor;
                slowed
            }),
            duration: self.duration * factor,
        }
    }

    /// Over the whole duration, between samples as well: at the ends and where the next derivative is 0.
    pub fn extremes(&self) -> Extremes {
        let (velocity, acceleration, jerk) = (self.velocity(), self.acceleration(), self.jerk());
        let snap = derivative::<3, 2>(&jerk);
        let end = self.duration;
        let jerk_turns = roots(&snap, &Few::default(), end);
        let acceleration_turns = roots(&jerk, &jerk_turns, end);
        let velocity_turns = roots(&acceleration, &acceleration_turns, end);
        let position_turns = roots(&velocity, &velocity_turns, end);
        let largest = |of: &[f64], turns: &Few| {
            let at = |time: &f64| value(of, *time).abs();
            turns.as_slice().iter().chain(&[0.0, end]).map(at).fold(0.0, f64::max)
        };
        let ends = [0.0, end];
        let times = position_turns.as_slice().iter().chain(&ends);
        let positions = times.map(|time| value(&self.coefficients, *time));
        Extremes {
            position: positions.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], position| {
                [least.min(position), most.max(position)]
            }),
            velocity: largest(&velocity, &velocity_turns),
            acceleration: largest(&acceleration, &acceleration_turns),
            jerk: largest(&jerk, &jerk_turns),
        }
    }

    /// Largest jerk between two times, either way.
    pub(crate) fn largest_jerk(&self, from: f64, to: f64) -> f64 {
        let jerk = self.jerk();
        let turn = -jerk[1] / (2.0 * jerk[2]);
        let turn = if (from..=to).contains(&turn) { turn } else { from };
        [from, turn, to]
            .map(|time| value(&jerk, time).abs())
            .into_iter()
            .fold(0.0, f64::max)
    }

    fn velocity(&self) -> [f64; 5] {
        derivative(&self.coefficients)
    }

    fn acceleration(&self) -> [f64; 4] {
        derivative(&self.velocity())
    }

    fn jerk(&self) -> [f64; 3] {
        derivative(&self.acceleration())
    }
}

/// `M` is `N - 1`.
fn derivative<const N: usize, const M: usize>(coefficients: &[f64; N]) -> [f64; M] {
    std::array::from_fn(|power| (power + 1) as f64 * coefficients[power + 1])
}
