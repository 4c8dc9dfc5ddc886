//! Smooth motions of joints within limits, and stops from anywhere.
//!
//! Motions are minimum-jerk (Flash and Hogan, "The coordination of arm movements", Journal of Neuroscience 5(7), 1985):
//! quintic polynomials of time, whose extremes are found in closed form, so that limits hold between samples as well.
//! Times are seconds from the motion's begin; joints are radians, or metres where they slide.
//!
//! ```
//! use trajectory::{JointLimits, Motion};
//!
//! let limits = [JointLimits { lower: -3.0, upper: 3.0, velocity: 2.0, acceleration: 10.0, jerk: 100.0 }; 2];
//! let motion = Motion::rest_to_rest(&[0.0, 1.0], &[1.0, -1.0], &limits)?;
//! assert_eq!(motion.check(&limits), Ok(()));
//! let end = motion.sample(motion.duration());
//! assert!((end[1].position + 1.0).abs() < 1e-9 && end[1].velocity.abs() < 1e-9);
//! # Ok::<(), trajectory::TrajectoryError>(())
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
