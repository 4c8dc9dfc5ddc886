//! Segments one after the other.

use crate::error::TrajectoryError;
use crate::limits::JointLimits;
use crate::motion::{Motion, SHORTEST};
use crate::quintic::State;
use crate::segment::Segment;

/// Largest jumps between segments, as shares of the larger value (at least of 1): position, speed, acceleration.
const JUMPS: [f64; 3] = [1e-9, 1e-7, 1e-5];

/// Segments that follow each other without a jump of position, speed or acceleration.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory<const N: usize> {
    /// At least one.
    segments: Vec<Segment<N>>,
    /// When each segment ends, seconds from the begin.
    ends: Vec<f64>,
}

impl<const N: usize> Trajectory<N> {
    /// From segments in their order.
    ///
    /// # Errors
    /// No segments; a jump of position (1e-9), speed (1e-7) or acceleration (1e-5) between two of them.
    pub fn new(segments: Vec<Segment<N>>) -> Result<Self, TrajectoryError> {
        if segments.is_empty() {
            return Err(TrajectoryError::Empty { what: "segments" });
        }
        let trajectory = Self::joined(segments);
        trajectory.require_continuity()?;
        Ok(trajectory)
    }

    /// Rests at a place, for at least a millisecond.
    ///
    /// # Errors
    /// Numbers that are not finite, a negative time.
    pub fn hold(position: &[f64; N], seconds: f64) -> Result<Self, TrajectoryError> {
        if seconds.is_nan() || seconds < 0.0 {
            return Err(TrajectoryError::Duration { value: seconds });
        }
        let rest = position.map(State::at);
        Ok(Self::joined(vec![Segment::between(
            &rest,
            &rest,
            seconds.max(SHORTEST),
        )?]))
    }

    /// From segments, at least one, that are known to fit together.
    pub(crate) fn joined(segments: Vec<Segment<N>>) -> Self {
        let mut end = 0.0;
        let after = |segment: &Segment<N>| {
            end += segment.duration();
            end
        };
        Self {
            ends: segments.iter().map(after).collect(),
            segments,
        }
    }

    /// Seconds.
    pub fn duration(&self) -> f64 {
        self.ends[self.ends.len() - 1]
    }

    /// In their order.
    pub fn segments(&self) -> &[Segment<N>] {
        &self.segments
    }

    /// Segments with the times of their begins, seconds.
    pub(crate) fn placed(&self) -> impl Iterator<Item = (f64, &Segment<N>)> {
        let begins = std::iter::once(&0.0).chain(&self.ends);
        begins.copied().zip(&self.segments)
    }

    /// All joints at a time, seconds from the begin; before it and after the end the states there. Does not allocate.
    pub fn sample(&self, time: f64) -> [State; N] {
        let (segment, time) = self.place(time);
        segment.sample(time)
    }

    /// Jerks of all joints at a time, rad/s³.
    pub fn jerk(&self, time: f64) -> [f64; N] {
        let (segment, time) = self.place(time);
        std::array::from_fn(|index| segment.joints()[index].jerk_at(time))
    }

    /// The first states.
    pub fn start(&self) -> [State; N] {
        self.segments[0].sample(0.0)
    }

    /// The last states.
    pub fn end(&self) -> [State; N] {
        let last = &self.segments[self.segments.len() - 1];
        last.sample(last.duration())
    }

    /// This one, then the other, which begins where this one ends.
    ///
    /// # Errors
    /// A jump of position, speed or acceleration where they meet.
    pub fn then(mut self, next: Self) -> Result<Self, TrajectoryError> {
        require_same(&self.end(), &next.start(), self.duration())?;
        self.segments.extend(next.segments);
        Ok(Self::joined(self.segments))
    }

    /// Many one after the other.
    ///
    /// # Errors
    /// None given; a jump where two of them meet.
    pub fn concatenate(parts: impl IntoIterator<Item = Self>) -> Result<Self, TrajectoryError> {
        let segments = parts.into_iter().flat_map(|part| part.segments);
        Self::new(segments.collect())
    }

    /// The same way in `factor` times the time.
    ///
    /// # Errors
    /// A factor that is not finite and more than 0.
    pub fn slowed(&self, factor: f64) -> Result<Self, TrajectoryError> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(TrajectoryError::Argument {
                what: "factor of time",
                value: factor,
                allowed: "finite and more than 0",
            });
        }
        let slowed = self.segments.iter().map(|segment| segment.slowed(factor));
        Ok(Self::joined(slowed.collect()))
    }

    /// Whether all limits hold at all times, between samples as well, and nothing jumps; if not what does not.
    pub fn check(&self, limits: &[JointLimits; N]) -> Result<(), TrajectoryError> {
        for (index, limits) in limits.iter().enumerate() {
            limits.check(index + 1)?;
        }
        self.segments.iter().try_for_each(|segment| segment.check(limits))?;
        self.require_continuity()
    }

    /// Refuses a trajectory that begins or ends while it moves (1e-6 rad/s, 1e-4 rad/s²).
    pub fn require_rest(&self) -> Result<(), TrajectoryError> {
        for (end, states) in [("begin", self.start()), ("end", self.end())] {
            for (index, state) in states.iter().enumerate() {
                let numbers = [
                    ("speed", state.velocity, 1e-6),
                    ("acceleration", state.acceleration, 1e-4),
                ];
                if let Some((what, value, _)) = numbers.into_iter().find(|(_, value, most)| value.abs() > *most) {
                    let joint = index + 1;
                    return Err(TrajectoryError::NotAtRest {
                        joint,
                        what,
                        end,
                        value,
                    });
                }
            }
        }
        Ok(())
    }

    /// How many times the duration is needed for speed, acceleration and jerk to keep the limits.
    pub(crate) fn pace(&self, limits: &[JointLimits; N]) -> f64 {
        let paces = self.segments.iter().map(|segment| segment.pace(limits));
        paces.fold(0.0, f64::max)
    }

    fn place(&self, time: f64) -> (&Segment<N>, f64) {
        let index = self.ends.partition_point(|end| *end < time);
        let index = index.min(self.segments.len() - 1);
        let begin = if index == 0 { 0.0 } else { self.ends[index - 1] };
        (&self.segments[index], time - begin)
    }

    fn require_continuity(&self) -> Result<(), TrajectoryError> {
        let mut pairs = self.segments.windows(2).zip(&self.ends);
        pairs
            .try_for_each(|(pair, time)| require_same(&pair[0].sample(pair[0].duration()), &pair[1].sample(0.0), *time))
    }
}

impl<const N: usize> From<Motion<N>> for Trajectory<N> {
    fn from(motion: Motion<N>) -> Self {
        Self::joined(vec![*motion.segment()])
    }
}

impl<const N: usize> From<Segment<N>> for Trajectory<N> {
    fn from(segment: Segment<N>) -> Self {
        Self::joined(vec![segment])
    }
}

fn require_same<const N: usize>(before: &[State; N], after: &[State; N], time: f64) -> Result<(), TrajectoryError> {
    for (index, (before, after)) in before.iter().zip(after).enumerate() {
        let pairs = [
            ("position", before.position, after.position),
            ("speed", before.velocity, after.velocity),
            ("acceleration", before.acceleration, after.acceleration),
        ];
        for ((what, before, after), share) in pairs.into_iter().zip(JUMPS) {
            let most = share * before.abs().max(after.abs()).max(1.0);
            let is_same = (before - after).abs() <= most;
            if !is_same {
                let joint = index + 1;
                return Err(TrajectoryError::Jump {
                    joint,
                    what,
                    time,
                    before,
                    after,
                });
            }
        }
    }
    Ok(())
}
