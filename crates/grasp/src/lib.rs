//! Where a suction cup can hold an object: graspable patches of two views, put in correspondence and ranked.
//!
//! [`plan`](plan()) takes what shading says of one capture in one or two calibrated views (normals in the base frame,
//! depth edges, confidence, mask, perhaps depth) and a [`Cup`], and gives grasps, best first, and every candidate that
//! was refused with the test it failed, what was measured and what is allowed. [`plan_thin`] does so for flat objects
//! that only their outlines tell. The method, its sources and figures are in this crate's `README.md`.
//!
//! [`Grasp::approach`] gives the tool's poses before, at and after the contact. Not here: whether the arm gets there and
//! what it hits on the way.
//!
//! ```
//! use geometry::nalgebra::{UnitQuaternion, Vector3};
//! use geometry::{PinholeCamera, RigidTransform};
//! use grasp::{Cup, PlanOptions, Source, ViewInput, plan};
//! use imaging::{Image, Mask};
//!
//! // A level plate of 60 x 60 mm, 10 mm over the table, seen by one camera from 0.3 m above it.
//! let camera = PinholeCamera::new(200, 200, [500.0; 2], [99.5; 2])?;
//! let looking_down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
//! let is_plate = |x: usize, y: usize| (50..150).contains(&x) && (50..150).contains(&y);
//! let image = |inside: f32, outside: f32| Image::from_fn(200, 200, |x, y| if is_plate(x, y) { inside } else { outside });
//! let nothing = Mask::from_nonzero(&Image::filled(200, 200, 0));
//! let view = ViewInput {
//!     name: "c1",
//!     camera,
//!     base_from_camera: RigidTransform::from_parts(Vector3::new(0.4, 0.0, 0.31), looking_down),
//!     normals: &Image::from_fn(200, 200, |x, y| if is_plate(x, y) { [0.0, 0.0, 1.0] } else { [f32::NAN; 3] }),
//!     confidence: &image(0.9, 0.0),
//!     edges: &nothing,
//!     edge_confidence: &image(0.0, 0.0),
//!     mask: &Mask::from_nonzero(&image(1.0, 0.0).map(|&inside| inside as u8)),
//!     depth: Some(&image(0.3, f32::NAN)),
//! };
//! let found = plan(&[view], &Cup::default(), &PlanOptions::default())?;
//! let best = &found.grasps[0];
//! assert!((best.contact - geometry::nalgebra::Point3::new(0.4, 0.0, 0.01)).norm() < 0.002);
//! assert!(best.approach_axis().z < -0.999 && matches!(best.source, Source::OneView { .. }));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod align;
mod approach;
mod assess;
mod carried;
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
mod overlay;
mod patch;
mod plan;
mod rank;
mod refusal;
mod region;
mod result;
mod seat;
mod specks;
mod stem;
mod surface;
mod thin;
mod triangulate;
mod view;

pub use approach::{Approach, Way};
pub use cup::Cup;
pub use error::GraspError;
pub use options::{Limits, MatchOptions, PlanOptions, SearchOptions, Weights};
pub use overlay::Overlay;
pub use plan::plan;
pub use refusal::{Failure, Refused, Test};
pub use result::{Carried, Grasp, Measured, Plan, Scores, Source};
pub use thin::plan_thin;
pub use view::ViewInput;
