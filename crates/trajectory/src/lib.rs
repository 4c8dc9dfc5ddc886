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

mod error;
mod limits;
mod motion;
mod quintic;
mod roots;
mod stop;

pub use error::TrajectoryError;
pub use limits::JointLimits;
pub use motion::Motion;
pub use quintic::{Extremes, Quintic, State};
pub use stop::Stop;
