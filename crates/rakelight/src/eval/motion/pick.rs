//! Home, over an object, straight down and up, over a bin, home.

use std::f64::consts::PI;

use geometry::RigidTransform;
use geometry::nalgebra::{SVector, UnitQuaternion, Vector3};
use kinematics::IkOptions;
use trajectory::{Planner, Trajectory};

const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
/// Top of the object, and a place over the bin, metres.
const OBJECT: [f64; 3] = [0.43, 0.05, 0.03];
const OVER_BIN: [f64; 3] = [0.3, -0.42, 0.25];
/// From above the object down to it, metres.
const DESCENT: f64 = 0.12;
/// For the cup to seal, and to let go, seconds.
const SEALING: f64 = 0.3;
const LETTING_GO: f64 = 0.2;

/// A part of the motion.
pub(super) struct Part {
    /// For people.
    pub(super) what: &'static str,
    /// Seconds from the begin of the whole.
    pub(super) begin: f64,
    /// Seconds.
    pub(super) duration: f64,
}

pub(super) struct Pick {
    pub(super) trajectory: Trajectory<7>,
    pub(super) parts: Vec<Part>,
}

pub(super) fn plan(planner: &Planner<7>) -> anyhow::Result<Pick> {
    let [x, y, z] = OBJECT;
    let (object, above) = (pose(OBJECT), pose([x, y, z + DESCENT]));
    let pregrasp = solve(planner, &above, &HOME)?;
    let approach = planner.joint_motion(&HOME, &pregrasp)?;
    let down = planner.line(&pregrasp, &object)?.trajectory;
    let grasp = end(&down);
    let up = planner.line(&grasp, &above)?.trajectory;
    let lifted = end(&up);
    let drop = solve(planner, &pose(OVER_BIN), &lifted)?;
    let parts = vec![
        ("to above the object", approach),
        ("down", down),
        ("seal", Trajectory::hold(&grasp, SEALING)?),
        ("up", up),
        ("to the bin", planner.joint_motion(&lifted, &drop)?),
        ("let go", Trajectory::hold(&drop, LETTING_GO)?),
        ("home", planner.joint_motion(&drop, &HOME)?),
    ];
    let mut begin = 0.0;
    let named = parts.iter().map(|(what, part)| {
        let part = Part {
            what,
            begin,
            duration: part.duration(),
        };
        begin += part.duration;
        part
    });
    let named = named.collect();
    let trajectory = Trajectory::concatenate(parts.into_iter().map(|(_, part)| part))?;
    planner.check(&trajectory)?;
    Ok(Pick {
        trajectory,
        parts: named,
    })
}

/// The cup looks down.
fn pose([x, y, z]: [f64; 3]) -> RigidTransform {
    RigidTransform::from_parts(Vector3::new(x, y, z), UnitQuaternion::from_euler_angles(PI, 0.0, 0.0))
}

fn solve(planner: &Planner<7>, pose: &RigidTransform, seed: &[f64; 7]) -> anyhow::Result<[f64; 7]> {
    let found = planner
        .chain()
        .solve(pose, &SVector::from(*seed), &IkOptions::default())?;
    Ok(found.angles.into())
}

fn end(trajectory: &Trajectory<7>) -> [f64; 7] {
    trajectory.end().map(|state| state.position)
}
