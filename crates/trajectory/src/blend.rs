//! Joint motions through waypoints without stops.

use crate::error::TrajectoryError;
use crate::motion::Motion;
use crate::planner::Planner;
use crate::quintic::State;
use crate::schedule::{Leg, events, overlap, schedule};
use crate::segment::Segment;
use crate::tool_speed::ToolSpeed;
use crate::trajectory::Trajectory;

/// Shares of the largest overlap among which the quickest is taken; without overlap the arm stops at all waypoints.
const SHARES: [f64; 4] = [1.0, 0.7, 0.4, 0.0];
/// Rounds in which legs that are too fast are slowed one by one.
const ROUNDS: usize = 6;
/// Waypoints nearer to each other than this are one, radians.
const SAME: f64 = 1e-9;

/// Straight ways in joint space.
struct Legs<'a, const N: usize> {
    planner: &'a Planner<N>,
    waypoints: &'a [[f64; N]],
    /// From each waypoint to the next.
    ways: Vec<[f64; N]>,
    tolerance: f64,
}

impl<const N: usize> Planner<N> {
    /// From the first waypoint to the last, from rest to rest, past all others within `tolerance` without stopping.
    ///
    /// The sum of the squares of the joints' distances to the straight ways between waypoints stays within the square of
    /// `tolerance` (radians), and so does that to each waypoint once. With tolerance 0 the arm stops at every waypoint.
    /// Waypoints that repeat the one before are skipped; a single one is held for a millisecond.
    ///
    /// # Errors
    /// No waypoints; numbers that are not finite; a waypoint outside the limits; a tolerance that is negative.
    pub fn through(&self, waypoints: &[[f64; N]], tolerance: f64) -> Result<Trajectory<N>, TrajectoryError> {
        require_tolerance("blend tolerance", tolerance)?;
        let waypoints = distinct(waypoints);
        let Some(first) = waypoints.first() else {
            return Err(TrajectoryError::Empty { what: "waypoints" });
        };
        // Checks the first one, too.
        let alone = Motion::rest_to_rest(first, first, &self.limits.joints)?;
        let mut durations = Vec::with_capacity(waypoints.len());
        for pair in waypoints.windows(2) {
            durations.push(self.joint_motion(&pair[0], &pair[1])?.duration());
        }
        if durations.is_empty() {
            return Ok(Trajectory::from(alone));
        }
        let ways = waypoints
            .windows(2)
            .map(|pair| std::array::from_fn(|joint| pair[1][joint] - pair[0][joint]));
        let legs = Legs {
            planner: self,
            ways: ways.collect(),
            waypoints: &waypoints,
            tolerance,
        };
        legs.quickest(&durations)
    }
}

pub(crate) fn require_tolerance(what: &'static str, value: f64) -> Result<(), TrajectoryError> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    let allowed = "finite and not negative";
    Err(TrajectoryError::Argument { what, value, allowed })
}

/// Without those that repeat the one before; the last one stays as it is.
fn distinct<const N: usize>(waypoints: &[[f64; N]]) -> Vec<[f64; N]> {
    let mut kept: Vec<[f64; N]> = Vec::with_capacity(waypoints.len());
    for waypoint in waypoints {
        let is_same = |last: &[f64; N]| last.iter().zip(waypoint).all(|(a, b)| (a - b).abs() <= SAME);
        match kept.last_mut() {
            Some(last) if is_same(last) => *last = *waypoint,
            _ => kept.push(*waypoint),
        }
    }
    kept
}

impl<const N: usize> Legs<'_, N> {
    /// The quickest over all shares of overlap. The tool's speed, which takes longer to find, is looked at for the best
    /// one only, and again without overlap should that have cost more than stopping does.
    fn quickest(&self, durations: &[f64]) -> Result<Trajectory<N>, TrajectoryError> {
        let of_joints = |segment: &Segment<N>| Ok(segment.pace(&self.planner.limits.joints));
        let mut best: Option<(f64, f64)> = None;
        for share in SHARES {
            let duration = self.blended(durations, share, &of_joints)?.duration();
            if best.is_none_or(|(shortest, _)| duration < shortest) {
                best = Some((duration, share));
            }
        }
        let share = best.map_or(0.0, |(_, share)| share);
        let of_all = |segment: &Segment<N>| self.pace(segment);
        let blended = self.blended(durations, share, &of_all)?;
        let stopping = self.blended(durations, 0.0, &of_joints)?;
        Ok(if blended.duration() < stopping.duration() {
            blended
        } else {
            stopping
        })
    }

    fn pace(&self, segment: &Segment<N>) -> Result<f64, TrajectoryError> {
        let Planner { chain, limits, reach } = self.planner;
        let tool = ToolSpeed::along(chain, reach, &Trajectory::from(*segment))?;
        Ok(segment.pace(&limits.joints).max(tool.bound / limits.tool_speed))
    }

    /// Legs that take part in a piece that is too fast are slowed, round by round; what then is left slows them all.
    fn blended(
        &self,
        durations: &[f64],
        share: f64,
        pace: &impl Fn(&Segment<N>) -> Result<f64, TrajectoryError>,
    ) -> Result<Trajectory<N>, TrajectoryError> {
        let mut durations = durations.to_vec();
        for _ in 0..ROUNDS {
            let legs = self.schedule(&durations, share);
            let mut slower = vec![1.0_f64; legs.len()];
            for (begin, segment) in self.segments(&legs) {
                let pace = pace(&segment)?;
                let end = begin + segment.duration();
                let active = legs
                    .iter()
                    .zip(&mut slower)
                    .filter(|(leg, _)| leg.is_active(begin, end));
                active.for_each(|(_, slower)| *slower = slower.max(pace));
            }
            if slower.iter().all(|slower| *slower <= 1.0) {
                break;
            }
            let pairs = durations.iter_mut().zip(&slower);
            pairs.for_each(|(duration, slower)| *duration *= slower);
        }
        let segments: Vec<_> = self.segments(&self.schedule(&durations, share)).collect();
        let mut rest = 1.0_f64;
        for (_, segment) in &segments {
            rest = rest.max(pace(segment)?);
        }
        Trajectory::joined(segments.into_iter().map(|(_, segment)| segment).collect()).slowed(rest)
    }

    fn schedule(&self, durations: &[f64], share: f64) -> Vec<Leg> {
        let corners = self.ways.windows(2).zip(durations.windows(2));
        let overlaps = corners
            .map(|(ways, durations)| share * overlap(&ways[0], &ways[1], [durations[0], durations[1]], self.tolerance));
        schedule(durations, &overlaps.collect::<Vec<_>>())
    }

    /// With the times of their begins.
    fn segments(&self, legs: &[Leg]) -> impl Iterator<Item = (f64, Segment<N>)> {
        let times = events(legs);
        let states: Vec<[State; N]> = times.iter().map(|time| self.states(legs, *time)).collect();
        (1..times.len()).map(move |index| {
            let (begin, end) = (times[index - 1], times[index]);
            (begin, Segment::new(&states[index - 1], &states[index], end - begin))
        })
    }

    /// Waypoint reached plus the shares of the ways that are under way: the ends are exact.
    fn states(&self, legs: &[Leg], time: f64) -> [State; N] {
        let done = legs.iter().take_while(|leg| leg.end() <= time).count();
        let mut states = self.waypoints[done].map(State::at);
        for (leg, way) in legs.iter().zip(&self.ways).skip(done) {
            let [share, speed, acceleration] = leg.phase(time);
            for (state, way) in states.iter_mut().zip(way) {
                state.position += way * share;
                state.velocity += way * speed;
                state.acceleration += way * acceleration;
            }
        }
        states
    }
}
