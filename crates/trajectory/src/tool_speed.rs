//! How fast the tool's origin becomes, between samples as well.
//!
//! The velocity v(t) = Jᵥ(q) q̇ is computed at the ends of intervals. Between them it is off the straight line from one
//! end to the other by at most h²/8 times the largest |v̈|, and a straight line is longest at an end, so that
//! `|v| <= max(|v₀|, |v₁|) + h²/8 max |v̈|`. Intervals where that leaves too much open are halved.
//!
//! v̈ is the third derivative of the tool's position. Each derivative by a joint is a cross product with that joint's
//! axis, hence with rₖ, the longest way from joint k to the tool, and joints ordered from the base,
//! `|v̈| <= Σ rᵢ |q⃛ᵢ| + 3 ΣΣ r_max(i,j) |q̈ᵢ| |q̇ⱼ| + ΣΣΣ r_max(i,j,k) |q̇ᵢ| |q̇ⱼ| |q̇ₖ|`.

use kinematics::Chain;
use nalgebra::{SVector, Vector3};

use crate::error::TrajectoryError;
use crate::segment::Segment;
use crate::trajectory::Trajectory;

/// Share by which the bound may be above the largest speed found.
const TIGHTNESS: f64 = 2e-3;
/// Speeds below this are not looked into, metres per second.
const STILL: f64 = 1e-9;
/// Intervals of a trajectory to begin with.
const INTERVALS: usize = 16;
/// Most halvings of an interval; the bound holds even there.
const MOST_HALVINGS: usize = 16;

/// Longest way from each joint to the tool, metres.
#[derive(Debug, Clone)]
pub(crate) struct Reach<const N: usize>([f64; N]);

impl<const N: usize> Reach<N> {
    /// The joints' origins are fixed in the frames before them: their distances are the same at all angles.
    pub(crate) fn of(chain: &Chain<N>) -> Result<Self, TrajectoryError> {
        let zero = SVector::zeros();
        let frames = chain.joint_frames(&zero)?;
        let mut next = chain.forward(&zero)?.translation();
        let (mut reach, mut sum) = ([0.0; N], 0.0);
        for (slot, frame) in reach.iter_mut().zip(&frames).rev() {
            let origin = frame.translation();
            sum += (next - origin).norm();
            (*slot, next) = (sum, origin);
        }
        Ok(Self(reach))
    }

    /// Bound of |v̈| for joints with at most these speeds, accelerations and jerks: the sums over all joints up to one
    /// minus those up to the one before are what that joint is the last of.
    fn jerk(&self, joints: &[[f64; 3]; N]) -> f64 {
        let (mut jerk, mut speed, mut acceleration) = (0.0, 0.0, 0.0);
        let (mut pairs, mut triples) = (0.0, 0.0);
        for (reach, joint) in self.0.iter().zip(joints) {
            speed += joint[0];
            acceleration += joint[1];
            let (pairs_now, triples_now) = (acceleration * speed, speed * speed * speed);
            jerk += reach * (joint[2] + 3.0 * (pairs_now - pairs) + (triples_now - triples));
            (pairs, triples) = (pairs_now, triples_now);
        }
        jerk
    }
}

/// The largest speed of the tool's origin along a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ToolSpeed {
    /// It is nowhere larger than this, between samples as well; within 0.2 % of `reached`. Metres per second.
    pub bound: f64,
    /// Found at `time`, metres per second.
    pub reached: f64,
    /// Seconds from the trajectory's begin.
    pub time: f64,
}

/// The end of an interval.
struct Node<const N: usize> {
    /// From the segment's begin.
    time: f64,
    velocity: Vector3<f64>,
    /// Speed and acceleration, without signs.
    joints: [[f64; 2]; N],
}

struct Search<'a, const N: usize> {
    chain: &'a Chain<N>,
    reach: &'a Reach<N>,
    found: ToolSpeed,
}

impl ToolSpeed {
    pub(crate) fn along<const N: usize>(
        chain: &Chain<N>,
        reach: &Reach<N>,
        trajectory: &Trajectory<N>,
    ) -> Result<Self, TrajectoryError> {
        let found = Self::default();
        let mut search = Search { chain, reach, found };
        let count = INTERVALS.div_ceil(trajectory.segments().len());
        let mut places = Vec::with_capacity(trajectory.segments().len());
        // All ends first: the fastest of them spares most halvings.
        for (begin, segment) in trajectory.placed() {
            let step = segment.duration() / count as f64;
            let nodes: Result<Vec<_>, _> = (0..=count)
                .map(|index| search.node(segment, begin, index as f64 * step))
                .collect();
            places.push((begin, segment, nodes?));
        }
        for (begin, segment, nodes) in &places {
            for pair in nodes.windows(2) {
                search.between((*begin, segment), &pair[0], &pair[1], 0)?;
            }
        }
        Ok(search.found)
    }
}

impl<const N: usize> Search<'_, N> {
    fn node(&mut self, segment: &Segment<N>, begin: f64, time: f64) -> Result<Node<N>, TrajectoryError> {
        let states = segment.sample(time);
        let (_, jacobian) = self
            .chain
            .jacobian(&SVector::from(states.map(|state| state.position)))?;
        let twist = jacobian * SVector::from(states.map(|state| state.velocity));
        let velocity: Vector3<f64> = twist.fixed_rows::<3>(0).into();
        let speed = velocity.norm();
        if speed > self.found.reached {
            (self.found.reached, self.found.time) = (speed, begin + time);
        }
        Ok(Node {
            time,
            velocity,
            joints: states.map(|state| [state.velocity.abs(), state.acceleration.abs()]),
        })
    }

    fn between(
        &mut self,
        (begin, segment): (f64, &Segment<N>),
        low: &Node<N>,
        high: &Node<N>,
        halvings: usize,
    ) -> Result<(), TrajectoryError> {
        let step = high.time - low.time;
        let jerk = self.reach.jerk(&joint_bounds(segment, low, high));
        let bound = low.velocity.norm().max(high.velocity.norm()) + step * step / 8.0 * jerk;
        if bound <= self.found.reached * (1.0 + TIGHTNESS) + STILL || halvings == MOST_HALVINGS {
            self.found.bound = self.found.bound.max(bound);
            return Ok(());
        }
        let middle = self.node(segment, begin, f64::midpoint(low.time, high.time))?;
        self.between((begin, segment), low, &middle, halvings + 1)?;
        self.between((begin, segment), &middle, high, halvings + 1)
    }
}

/// Speed, acceleration and jerk of the joints in an interval, from those at its ends and the jerk between.
fn joint_bounds<const N: usize>(segment: &Segment<N>, low: &Node<N>, high: &Node<N>) -> [[f64; 3]; N] {
    let step = high.time - low.time;
    std::array::from_fn(|index| {
        let jerk = segment.joints()[index].largest_jerk(low.time, high.time);
        let [low, high] = [low, high].map(|node| node.joints[index]);
        let speed = low[0].max(high[0]) + step * step / 8.0 * jerk;
        let acceleration = low[1].max(high[1]) + step / 2.0 * jerk;
        [speed, acceleration, jerk]
    })
}
