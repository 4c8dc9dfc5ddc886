//! Trajectories given by points and times, as `trajectory_msgs/JointTrajectory` carries them.
//!
//! Between points with positions, speeds and accelerations the quintic that meets them. Missing speeds are those of the
//! cubic spline through the positions (its acceleration does not jump; de Boor, "A Practical Guide to Splines", chapter
//! IV), at rest at the ends; missing accelerations are the mean of those of the cubics on both sides, and none at the
//! ends. So the result never jumps up to the acceleration, whatever was given.

use crate::error::TrajectoryError;
use crate::quintic::State;
use crate::segment::Segment;
use crate::trajectory::Trajectory;

/// Where the joints should be at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedPoint<const N: usize> {
    /// Seconds; 0 for the first point.
    pub time_from_start: f64,
    /// Radians or metres.
    pub positions: [f64; N],
    /// Per second; none to have them estimated.
    pub velocities: Option<[f64; N]>,
    /// Per second squared; none to have them estimated.
    pub accelerations: Option<[f64; N]>,
}

impl<const N: usize> Trajectory<N> {
    /// Through points at their times, the first of which is 0; who starts elsewhere puts the present state first. A
    /// single point is held for a millisecond. The points may break limits or end while they
    /// move: see [`Trajectory::check`] and [`Trajectory::require_rest`].
    ///
    /// # Errors
    /// No points; times that do not rise or do not begin at 0; numbers that are not finite.
    pub fn through_points(points: &[TimedPoint<N>]) -> Result<Self, TrajectoryError> {
        require_points(points)?;
        if let [point] = points {
            return Self::hold(&point.positions, 0.0);
        }
        let joints: [Vec<State>; N] = std::array::from_fn(|joint| states_of(points, joint));
        let at = |index: usize| std::array::from_fn(|joint: usize| joints[joint][index]);
        let segment = |(index, pair): (usize, &[TimedPoint<N>])| {
            let duration = pair[1].time_from_start - pair[0].time_from_start;
            Segment::between(&at(index), &at(index + 1), duration)
        };
        let segments: Result<Vec<_>, _> = points.windows(2).enumerate().map(segment).collect();
        Self::new(segments?)
    }
}

fn require_points<const N: usize>(points: &[TimedPoint<N>]) -> Result<(), TrajectoryError> {
    if points.is_empty() {
        return Err(TrajectoryError::Empty { what: "points" });
    }
    let mut before = None;
    for (index, point) in points.iter().enumerate() {
        let (number, time) = (index + 1, point.time_from_start);
        let (is_good, allowed) = match before {
            None => (time == 0.0, "0, the first point is the start"),
            Some(before) => (
                time.is_finite() && time > before,
                "finite and later than the point before",
            ),
        };
        if !is_good {
            return Err(TrajectoryError::PointTime {
                point: number,
                time,
                allowed,
            });
        }
        before = Some(time);
        require_finite(number, "position", &point.positions)?;
        require_finite(number, "velocity", point.velocities.as_ref().unwrap_or(&[0.0; N]))?;
        require_finite(
            number,
            "acceleration",
            point.accelerations.as_ref().unwrap_or(&[0.0; N]),
        )?;
    }
    Ok(())
}

fn require_finite<const N: usize>(point: usize, what: &'static str, values: &[f64; N]) -> Result<(), TrajectoryError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(TrajectoryError::PointNotFinite {
            point,
            joint: index + 1,
            what,
            value: values[index],
        }),
    }
}

/// Of one joint at all points.
fn states_of<const N: usize>(points: &[TimedPoint<N>], joint: usize) -> Vec<State> {
    let times: Vec<f64> = points.iter().map(|point| point.time_from_start).collect();
    let positions: Vec<f64> = points.iter().map(|point| point.positions[joint]).collect();
    let given: Vec<Option<f64>> = points
        .iter()
        .map(|point| point.velocities.map(|all| all[joint]))
        .collect();
    let velocities = spline_velocities(&times, &positions, &given);
    let last = points.len() - 1;
    let estimate = |index: usize| {
        if index == 0 || index == last {
            return 0.0;
        }
        // Second derivatives of the cubics before and after, at the point.
        let bend = |from: usize, to: usize, near: f64, far: f64| {
            let step = times[to] - times[from];
            (6.0 * (positions[to] - positions[from]) / step - 4.0 * near - 2.0 * far) / step
        };
        let now = velocities[index];
        let before = -bend(index - 1, index, now, velocities[index - 1]);
        let after = bend(index, index + 1, now, velocities[index + 1]);
        f64::midpoint(before, after)
    };
    let state = |(index, point): (usize, &TimedPoint<N>)| State {
        position: positions[index],
        velocity: velocities[index],
        acceleration: point.accelerations.map_or_else(|| estimate(index), |all| all[joint]),
    };
    points.iter().enumerate().map(state).collect()
}

/// Speeds for which the cubics' accelerations do not jump where none is given: with steps h and slopes d,
/// `v₋/h₋ + 2 v (1/h₋ + 1/h₊) + v₊/h₊ = 3 (d₋/h₋ + d₊/h₊)`; a tridiagonal system, solved from front to back and again
/// to the front.
fn spline_velocities(times: &[f64], positions: &[f64], given: &[Option<f64>]) -> Vec<f64> {
    let last = times.len() - 1;
    let inverse = |index: usize| 1.0 / (times[index + 1] - times[index]);
    let slope = |index: usize| (positions[index + 1] - positions[index]) * inverse(index);
    let (mut uppers, mut rights) = (vec![0.0; last + 1], vec![0.0; last + 1]);
    for index in 0..=last {
        let known = given[index].or((index == 0 || index == last).then_some(0.0));
        if let Some(velocity) = known {
            rights[index] = velocity;
            continue;
        }
        let (before, after) = (inverse(index - 1), inverse(index));
        let right = 3.0 * (slope(index - 1) * before + slope(index) * after);
        let pivot = 2.0 * (before + after) - before * uppers[index - 1];
        uppers[index] = after / pivot;
        rights[index] = (right - before * rights[index - 1]) / pivot;
    }
    for index in (0..last).rev() {
        rights[index] -= uppers[index] * rights[index + 1];
    }
    rights
}
