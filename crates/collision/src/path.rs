//! Ways through joint space, and how fast they are.

use crate::error::{CollisionError, require};

/// The duration is cut into as many; within each the largest speed counts.
const WINDOWS: usize = 64;
/// No arm is faster, rad/s.
const FASTEST: f64 = 1e3;

/// Joint angles over time.
pub trait JointPath<const N: usize> {
    /// Seconds.
    fn duration(&self) -> f64;

    /// Radians, at a time from 0 to the duration.
    fn angles(&self, time: f64) -> [f64; N];

    /// What the joints' speeds (rad/s, without sign) do not exceed between two times, exactly or more; the same for all
    /// times is allowed. The tighter they are, the fewer looks it takes.
    fn speed_bounds(&self, from: f64, to: f64) -> [f64; N];
}

/// A path from a function of time.
#[derive(Debug, Clone, Copy)]
pub struct FunctionPath<F, const N: usize> {
    /// Seconds.
    pub duration: f64,
    /// What the joints' speeds never exceed, rad/s.
    pub speeds: [f64; N],
    /// Joint angles at a time.
    pub angles: F,
}

impl<F: Fn(f64) -> [f64; N], const N: usize> JointPath<N> for FunctionPath<F, N> {
    fn duration(&self) -> f64 {
        self.duration
    }

    fn angles(&self, time: f64) -> [f64; N] {
        (self.angles)(time)
    }

    fn speed_bounds(&self, _from: f64, _to: f64) -> [f64; N] {
        self.speeds
    }
}

/// A part of a path.
#[derive(Debug, Clone, Copy)]
pub struct Stretch<'a, P> {
    path: &'a P,
    from: f64,
    to: f64,
}

impl<'a, P> Stretch<'a, P> {
    /// From one time of the path to another, seconds.
    ///
    /// # Errors
    /// Times that are not in order within the path.
    pub fn of<const N: usize>(path: &'a P, from: f64, to: f64) -> Result<Self, CollisionError>
    where
        P: JointPath<N>,
    {
        let allowed = "in order within the path";
        require("stretch of a path", "begin", from, from >= 0.0 && from <= to, allowed)?;
        require("stretch of a path", "end", to, to <= path.duration(), allowed)?;
        Ok(Self { path, from, to })
    }
}

impl<P: JointPath<N>, const N: usize> JointPath<N> for Stretch<'_, P> {
    fn duration(&self) -> f64 {
        self.to - self.from
    }

    fn angles(&self, time: f64) -> [f64; N] {
        self.path.angles((self.from + time).min(self.to))
    }

    fn speed_bounds(&self, from: f64, to: f64) -> [f64; N] {
        self.path.speed_bounds(self.from + from, (self.from + to).min(self.to))
    }
}

/// Speed bounds of a path, over windows of equal length.
pub(crate) struct SpeedWindows<const N: usize> {
    duration: f64,
    length: f64,
    bounds: [[f64; N]; WINDOWS],
}

impl<const N: usize> SpeedWindows<N> {
    pub(crate) fn new(path: &impl JointPath<N>) -> Result<Self, CollisionError> {
        let duration = path.duration();
        let is_allowed = duration.is_finite() && duration >= 0.0;
        require("path", "duration", duration, is_allowed, "0 s or more")?;
        let length = duration / WINDOWS as f64;
        let mut bounds = [[0.0; N]; WINDOWS];
        for (index, window) in bounds.iter_mut().enumerate() {
            *window = path.speed_bounds(index as f64 * length, (index + 1) as f64 * length);
            for &speed in window.iter() {
                require(
                    "path",
                    "speed bound",
                    speed,
                    (0.0..=FASTEST).contains(&speed),
                    "0 to 1000 rad/s",
                )?;
            }
        }
        Ok(Self {
            duration,
            length,
            bounds,
        })
    }

    pub(crate) fn duration(&self) -> f64 {
        self.duration
    }

    /// When a body that reaches this far (metres) from the joints' axes can first have gone a way (metres), from a time
    /// on; infinite if not on this path.
    ///
    /// Its reach grows by no more than what it has gone, so reach plus way is a bound until then.
    pub(crate) fn time_of_travel(&self, from: f64, way: f64, reaches: &[f64; N]) -> f64 {
        let (mut time, mut left) = (from, way);
        for (end, bounds) in self.windows(from) {
            let speed: f64 = bounds
                .iter()
                .zip(reaches)
                .filter(|(_, reach)| **reach > 0.0)
                .map(|(bound, reach)| bound * (reach + way))
                .sum();
            let travel = speed * (end - time);
            if travel >= left {
                return time + left / speed;
            }
            left -= travel;
            time = end;
        }
        f64::INFINITY
    }

    /// What each joint can turn between two times, radians.
    pub(crate) fn most_turned(&self, from: f64, to: f64) -> [f64; N] {
        let mut turned = [0.0; N];
        let mut time = from;
        for (end, bounds) in self.windows(from) {
            let end = end.min(to);
            for (sum, bound) in turned.iter_mut().zip(bounds) {
                *sum += bound * (end - time);
            }
            if end >= to {
                break;
            }
            time = end;
        }
        turned
    }

    /// Ends of the windows after a time, and their bounds. Times at a border may count to either side by rounding, so
    /// the window before is never left out.
    fn windows(&self, from: f64) -> impl Iterator<Item = (f64, &[f64; N])> {
        let end = |index: usize| {
            if index + 1 == WINDOWS {
                self.duration
            } else {
                (index + 1) as f64 * self.length
            }
        };
        let first = (0..WINDOWS).find(|&index| end(index) > from).unwrap_or(WINDOWS);
        (first..WINDOWS).map(move |index| (end(index), &self.bounds[index]))
    }
}
