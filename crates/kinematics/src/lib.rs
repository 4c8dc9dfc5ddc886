//! Where an arm's tool is, how it moves, and how to get it somewhere.
//!
//! A [`Chain`] is the way from one link of a URDF to another over `N` joints that turn; fixed joints between them are
//! folded in. It gives the tool's pose, the poses of all joints and the geometric Jacobian without allocating, and
//! [`Chain::solve`] the joint angles for a pose. Per-arm calibrations come in by [`Chain::with_modified_dh`].
//!
//! ```
//! use geometry::RigidTransform;
//! use kinematics::{Chain, IkOptions};
//! use nalgebra::SVector;
//!
//! let robot = urdf_rs::read_file(concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/xarm7.urdf"))?;
//! let chain: Chain<7> = Chain::from_urdf(&robot, "link_base", "link_eef")?;
//! let home = SVector::from([0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0]);
//! let pose = chain.forward(&home)?;
//! assert!((pose.translation().x - 0.350_648).abs() < 1e-6);
//! let found = chain.solve(&pose, &SVector::from([0.0, -0.3, 0.0, 0.8, 0.0, 1.0, 0.0]), &IkOptions::default())?;
//! assert!((chain.forward(&found.angles)?.translation() - pose.translation()).norm() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod calibration;
mod chain;
mod error;
mod inverse;
mod limits;
mod preference;
mod urdf;

pub use calibration::ModifiedDh;
pub use chain::{Chain, Jacobian, Joint, Limits};
pub use error::KinematicsError;
pub use inverse::{IkOptions, Solution};
pub use preference::Preference;
