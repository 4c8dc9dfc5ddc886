//! Whether an arm touches anything, now and along a path: itself, what stands around it, what cameras saw; with or
//! without an object in its tool.
//!
//! Links are capsules and boxes ([`ArmModel`], from a URDF), so are most obstacles ([`Scene`]); clouds of points lie in a
//! tree of balls. [`Checker::check`] names the contact at given joint angles, [`Checker::clearance`] the nearest pair, and
//! [`Checker::check_motion`] the first contact on a [`JointPath`], with nothing hidden between samples. What has to touch
//! gets an [`Allowance`]. It plans no paths and knows nothing of forces.
//!
//! Lengths are metres, angles radians, frames as everywhere: shapes stand in the frame of what carries them, obstacles in
//! the arm's base. Distances are signed; negative is a depth.
//!
//! ```
//! use collision::{ArmModel, Checker, FunctionPath, Scene, SelfCollision, XARM7_NEVER_TOUCHING};
//! use kinematics::Chain;
//!
//! let urdf = |file| format!("{}/../../urdf/{file}", env!("CARGO_MANIFEST_DIR"));
//! let robot = urdf_rs::read_file(urdf("xarm7.urdf"))?;
//! let chain: Chain<7> = Chain::from_urdf(&robot, "link_base", "link_tcp")?;
//! let home = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];
//! let leave_out = SelfCollision { never: &XARM7_NEVER_TOUCHING, free_at: &[home] };
//! let arm = ArmModel::from_urdf(&robot, "link_base", chain, &leave_out)?;
//!
//! let mut scene = Scene::from_urdf(&urdf_rs::read_file(urdf("cell.urdf"))?, "link_base")?;
//! scene.except("link_base", "table")?; // It stands there.
//!
//! let checker = Checker::new(&arm, &scene).with_margin(0.005)?;
//! assert_eq!(checker.check(&home)?, None);
//!
//! // Bend forward at 1 rad/s for a second.
//! let down = FunctionPath { duration: 1.0, speeds: [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], angles: |time| {
//!     let mut angles = home;
//!     angles[1] += time;
//!     angles
//! }};
//! let found = checker.check_motion(&down, 0.001)?.expect("the mat lies in the table, and both are in the way");
//! assert_eq!((found.contact.link, found.contact.with.name()), ("vacuum_gripper", "mat"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod allowance;
mod arm;
mod carried;
mod checker;
mod cloud;
mod distance;
mod error;
mod maths;
mod motion;
mod path;
mod scene;
mod segment;
mod shape;
mod urdf;
mod xarm7;

pub use allowance::Allowance;
pub use arm::{ArmModel, SelfCollision};
pub use carried::CarriedObject;
pub use checker::{Checker, Contact, Touched};
pub use cloud::PointCloud;
pub use error::CollisionError;
pub use motion::MotionContact;
pub use path::{FunctionPath, JointPath, Stretch};
pub use scene::{Bin, Scene};
pub use shape::Shape;
pub use xarm7::XARM7_NEVER_TOUCHING;
