//! Where a suction cup can hold an object: graspable patches of two views, put in correspondence and ranked.

mod align;
mod assess;
mod chart;
mod correspondence;
mod cup;
mod directions;
mod distance;
mod error;
mod footprint;
mod level;
mod likelihood;
mod mean_shift;
mod moments;
mod options;
mod patch;
mod plan;
mod rank;
mod refusal;
mod region;
mod result;
mod stem;
mod surface;
mod thin;
mod triangulate;
mod view;

pub use cup::Cup;
pub use error::GraspError;
pub use options::{Limits, MatchOptions, PlanOptions, SearchOptions, Weights};
pub use plan::plan;
pub use refusal::{Failure, Refused, Test};
pub use result::{Grasp, Measured, Plan, Scores, Source};
pub use thin::plan_thin;
pub use view::ViewInput;
