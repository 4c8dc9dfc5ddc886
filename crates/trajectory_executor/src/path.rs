//! A trajectory as the collision check sees it.

use collision::JointPath;
use devices::JointValues;
use trajectory::Trajectory;

/// The joints' way over time, with their largest speeds.
#[derive(Debug, Clone)]
pub struct TrajectoryPath<'a> {
    trajectory: &'a Trajectory<7>,
    /// Of each segment: its end (s) and the joints' largest speeds in it (rad/s).
    segments: Vec<(f64, JointValues)>,
}

impl<'a> TrajectoryPath<'a> {
    /// Looks for the largest speeds once: the check asks for them again and again.
    pub fn new(trajectory: &'a Trajectory<7>) -> Self {
        let mut end = 0.0;
        let segments = trajectory.segments().iter().map(|segment| {
            end += segment.duration();
            let speeds = segment.joints().each_ref().map(|joint| joint.extremes().velocity);
            (end, speeds)
        });
        Self {
            segments: segments.collect(),
            trajectory,
        }
    }
}

impl JointPath<7> for TrajectoryPath<'_> {
    fn duration(&self) -> f64 {
        self.trajectory.duration()
    }

    fn angles(&self, time: f64) -> JointValues {
        self.trajectory.sample(time).map(|state| state.position)
    }

    fn speed_bounds(&self, from: f64, to: f64) -> JointValues {
        let first = self.segments.partition_point(|(end, _)| *end < from);
        // The segment that lasts until `to` and beyond is the last that counts.
        let last = self.segments.partition_point(|(end, _)| *end <= to);
        let mut bounds = [0.0_f64; 7];
        for (_, speeds) in self.segments.iter().take(last + 1).skip(first) {
            for (bound, speed) in bounds.iter_mut().zip(speeds) {
                *bound = bound.max(*speed);
            }
        }
        bounds
    }
}
