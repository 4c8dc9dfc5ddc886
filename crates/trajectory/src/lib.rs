//! Smooth trajectories of an arm within limits, stops from anywhere, and a guard before the arm.
//!
//! Motions are minimum-jerk (Flash and Hogan, "The coordination of arm movements", Journal of Neuroscience 5(7), 1985):
//! quintic polynomials of time, whose extremes are found exactly, so that limits hold between samples as well. Times are
//! seconds from the begin; joints are radians, or metres where they slide. There is no clock in here, no collision check
//! and no dynamics: who streams set-points brings the time.
//!
//! - [`Planner`]: joint motions ([`Planner::joint_motion`]), past waypoints without stops ([`Planner::through`]), straight
//!   lines of the tool ([`Planner::line`], [`Planner::lines`]), all within [`TrajectoryLimits`], the tool's speed included.
//! - [`Trajectory`]: what they make: [`Segment`]s without jumps of position, speed or acceleration. Also from points with
//!   times, [`Trajectory::through_points`].
//! - [`Motion`] and [`Stop`]: from rest to rest, and to rest from any state; of any joints, without an arm.
//! - [`SetPointGuard`]: the last gate in the servo loop.
//!
//! ```
//! use geometry::RigidTransform;
//! use kinematics::Chain;
//! use nalgebra::{SVector, Vector3};
//! use trajectory::{Planner, SetPointGuard, Trajectory, TrajectoryLimits};
//!
//! // An arm with its tool; 20 rad/s², 400 rad/s³, 0.25 m/s.
//! let robot = urdf_rs::read_file(concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/xarm7.urdf"))?;
//! let arm: Chain<7> = Chain::from_urdf(&robot, "link_base", "link_tcp")?;
//! let planner = Planner::new(arm.clone(), TrajectoryLimits::of_chain(&arm, 20.0, 400.0, 0.25)?)?;
//!
//! // From home to above the object, 100 mm straight down, half a second for the cup, up again.
//! let home = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
//! let pregrasp = [0.4, -0.2, 0.0, 0.9, 0.0, 1.1, 0.4];
//! let approach = planner.joint_motion(&home, &pregrasp)?;
//! let above = arm.forward(&SVector::from(pregrasp))?;
//! let below = RigidTransform::from_parts(above.translation() - Vector3::z() * 0.1, above.rotation());
//! let down = planner.line(&pregrasp, &below)?;
//! assert!(down.position_error < 2e-4);
//! let grasp = down.trajectory.end().map(|state| state.position);
//! let up = planner.line(&grasp, &above)?;
//! let cycle = Trajectory::concatenate([approach, down.trajectory, Trajectory::hold(&grasp, 0.5)?, up.trajectory])?;
//! planner.check(&cycle)?;
//!
//! // Each control period what is wanted passes the guard, and then goes to the arm.
//! let mut guard = SetPointGuard::new(arm, *planner.limits(), 0.004, 2e-4, &home)?;
//! for step in 1..=(cycle.duration() / 0.004).ceil() as usize {
//!     let wanted = cycle.sample(step as f64 * 0.004).map(|state| state.position);
//!     let set_point = guard.pass(&wanted)?;
//!     assert_eq!(set_point, wanted);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod blend;
mod error;
mod guard;
mod limits;
mod line;
mod motion;
mod planner;
mod points;
mod quintic;
mod roots;
mod schedule;
mod segment;
mod stop;
mod tool_path;
mod tool_speed;
mod tracker;
mod trajectory;

pub use error::TrajectoryError;
pub use guard::{GuardFault, SetPointGuard};
pub use limits::{JointLimits, TrajectoryLimits};
pub use line::LinePlan;
pub use motion::Motion;
pub use planner::{Planner, Snapshot};
pub use points::TimedPoint;
pub use quintic::{Extremes, Quintic, State};
pub use segment::Segment;
pub use stop::Stop;
pub use tool_speed::ToolSpeed;
pub use trajectory::Trajectory;
