//! An arm that is not quite where it says.
//!
//! Images tell the target's pose to some 0.01 mm, an arm its flange's to some 0.1 mm, and an error of the arm moves all
//! corners of an image together. Taking it for independent errors of corners would leave hidden what the shapes in the
//! images say. So every stand has a small pose of its own between what the arm says and where it is, held near the
//! identity, and how near is told from all of them (variance components, estimated in turns with the rest).

use crate::bundle::{Bundle, Link, POSE, Prior, State};
use crate::levenberg::{Solved, solve};
use geometry::RigidTransform;

/// Standard deviations of the arm's rotation (radians) and translation (metres) at first, and within which they stay.
const FIRST: [f64; 2] = [3e-4, 2e-4];
const LEAST: [f64; 2] = [1e-5, 1e-5];
const MOST: [f64; 2] = [1e-2, 5e-3];
/// Of a corner at first, pixels.
const CORNER: f64 = 0.05;
/// A stand off by more standard deviations loses weight.
const ROBUST_SIGMAS: f64 = 4.0;
/// Rounds; deviations change by less than a hundredth after six.
const ROUNDS: usize = 8;
/// The median length of three normal components, in standard deviations.
const MEDIAN: f64 = 1.538;

/// Poses of the stands, all at the identity at first, behind the others in [`State::poses`].
pub(super) struct Slack {
    first: usize,
    stands: usize,
}

impl Slack {
    /// For so many stands.
    pub(super) fn new(poses: &mut Vec<RigidTransform>, stands: usize) -> Self {
        let first = poses.len();
        poses.extend(std::iter::repeat_n(RigidTransform::identity(), stands));
        Self { first, stands }
    }

    /// A stand's own pose.
    pub(super) fn link(&self, stand: usize) -> Link {
        Link::Sought(self.first + stand)
    }

    /// Fits everything.
    pub(super) fn solve(&self, bundle: &mut Bundle, start: State) -> Solved {
        let (mut corner, mut arm) = (CORNER, FIRST);
        self.hold(bundle, corner, arm);
        let mut solved = solve(bundle, start);
        for _ in 1..ROUNDS {
            (corner, arm) = (solved.sigma, self.deviations(&solved.state));
            self.hold(bundle, corner, arm);
            solved = solve(bundle, solved.state);
        }
        solved
    }

    fn hold(&self, bundle: &mut Bundle, corner: f64, arm: [f64; 2]) {
        bundle.priors = (0..self.stands)
            .map(|stand| Prior {
                pose: self.first + stand,
                weights: arm.map(|deviation| corner / deviation),
                scale: ROBUST_SIGMAS * corner * (POSE as f64).sqrt(),
            })
            .collect();
    }

    /// Of rotation and translation, from the medians; the poses that are sought take up a part of what there is.
    fn deviations(&self, state: &State) -> [f64; 2] {
        let stands = &state.poses[self.first..self.first + self.stands];
        let taken = (self.first as f64 / self.stands as f64).min(0.75);
        let median = |mut lengths: Vec<f64>| {
            lengths.sort_by(f64::total_cmp);
            lengths[lengths.len() / 2] / MEDIAN / (1.0 - taken).sqrt()
        };
        let found = [
            median(stands.iter().map(|pose| pose.rotation().angle()).collect()),
            median(stands.iter().map(|pose| pose.translation().norm()).collect()),
        ];
        std::array::from_fn(|i| found[i].clamp(LEAST[i], MOST[i]))
    }

    /// The state as the arm says it is.
    pub(super) fn taken_out(&self, state: &State) -> State {
        let mut plain = state.clone();
        for pose in &mut plain.poses[self.first..self.first + self.stands] {
            *pose = RigidTransform::identity();
        }
        plain
    }
}
