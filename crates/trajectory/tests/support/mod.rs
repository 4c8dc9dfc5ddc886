//! The xArm7 with its suction cup, random places, and limits looked at from outside.
#![allow(dead_code)]

use fastrand::Rng;
use kinematics::Chain;
use nalgebra::{SVector, Vector3};
use trajectory::{Planner, State, Trajectory, TrajectoryLimits};

pub(crate) const N: usize = 7;
pub(crate) const HOME: [f64; N] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
/// Of a real time trace, seconds.
pub(crate) const STEP: f64 = 5e-4;

pub(crate) fn arm() -> Chain<N> {
    let robot = urdf_rs::read_file(concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/xarm7.urdf")).unwrap();
    Chain::from_urdf(&robot, "link_base", "link_tcp").unwrap()
}

pub(crate) fn planner(tool_speed: f64) -> Planner<N> {
    let arm = arm();
    let limits = TrajectoryLimits::of_chain(&arm, 20.0, 400.0, tool_speed).unwrap();
    Planner::new(arm, limits).unwrap()
}

/// Within the limits of the arm, at most half a turn from the middle.
pub(crate) fn random_angles(random: &mut Rng, planner: &Planner<N>) -> [f64; N] {
    let half_turn = std::f64::consts::PI;
    planner.limits().joints.map(|joint| {
        joint.lower.max(-half_turn) + random.f64() * (joint.upper.min(half_turn) - joint.lower.max(-half_turn))
    })
}

pub(crate) fn tool(planner: &Planner<N>, states: &[State; N]) -> Vector3<f64> {
    let angles = SVector::from(states.map(|state| state.position));
    planner.chain().forward(&angles).unwrap().translation()
}

/// Samples of a trajectory must keep all limits, by their own values and by their differences: what an observer sees.
pub(crate) fn assert_limits(planner: &Planner<N>, trajectory: &Trajectory<N>, step: f64) {
    let limits = planner.limits();
    let count = (trajectory.duration() / step).ceil() as usize + 1;
    let mut before = trajectory.start();
    let mut tool_before = tool(planner, &before);
    for index in 1..=count {
        let now = trajectory.sample(index as f64 * step);
        for (joint, (now, (before, limits))) in now.iter().zip(before.iter().zip(&limits.joints)).enumerate() {
            let least = limits.lower - 1e-8;
            assert!(
                (least..=limits.upper + 1e-8).contains(&now.position),
                "joint {joint}: {now:?}"
            );
            assert!(
                now.velocity.abs() <= limits.velocity * (1.0 + 1e-8),
                "joint {joint}: {now:?}"
            );
            assert!(
                now.acceleration.abs() <= limits.acceleration * (1.0 + 1e-8),
                "joint {joint}: {now:?}"
            );
            let changes = [
                (now.position - before.position, limits.velocity),
                (now.velocity - before.velocity, limits.acceleration),
                (now.acceleration - before.acceleration, limits.jerk),
            ];
            for (change, most) in changes {
                assert!(
                    change.abs() <= most * step * (1.0 + 1e-6) + 1e-9,
                    "joint {joint}: {before:?} {now:?}"
                );
            }
        }
        let place = tool(planner, &now);
        let speed = (place - tool_before).norm() / step;
        assert!(speed <= limits.tool_speed * (1.0 + 1e-8), "tool at {speed} m/s");
        (before, tool_before) = (now, place);
    }
}

pub(crate) fn assert_ends(trajectory: &Trajectory<N>, from: &[f64; N], to: &[f64; N]) {
    for (states, wanted) in [(trajectory.start(), from), (trajectory.end(), to)] {
        for (state, wanted) in states.iter().zip(wanted) {
            assert!((state.position - wanted).abs() < 1e-9, "{state:?}, wanted {wanted}");
            assert!(
                state.velocity.abs() < 1e-9 && state.acceleration.abs() < 1e-6,
                "{state:?}"
            );
        }
    }
}
