//! Rigid transforms between named frames, the pinhole camera with distortion, triangle meshes and rays against them.
//!
//! Lengths are metres, angles radians, pixels count from the centre of the top left pixel (0, 0). A transform is named
//! `target_from_source`; in a product neighbouring names cancel. This crate knows no messages, files or clocks: values
//! of a `CameraInfo` or a TF message come in as plain arrays and are checked here.
//!
//! ```
//! use geometry::{PinholeCamera, RigidTransform, nalgebra::{Point2, Point3}};
//!
//! // A camera 0.5 m over the table, looking straight down with its x axis along base y.
//! let base_from_camera = RigidTransform::from_quaternion_xyzw([0.43, 0.0, 0.5], [0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0, 0.0])?;
//! let camera = PinholeCamera::new(1536, 1536, [2181.8, 2181.8], [767.5, 767.5])?;
//!
//! let point_in_camera = base_from_camera.inverse().transform_point(&Point3::new(0.43, 0.0, 0.0));
//! let pixel = camera.project(&point_in_camera).expect("in front of the camera");
//! assert!((pixel - Point2::new(767.5, 767.5)).norm() < 1e-9);
//! # Ok::<(), geometry::GeometryError>(())
//! ```

mod bvh;
mod camera;
mod distortion;
mod error;
mod mesh;
mod ray;
mod rectangle;
mod rigid_transform;

pub use bvh::TriangleBvh;
pub use camera::PinholeCamera;
pub use distortion::PlumbBob;
pub use error::GeometryError;
pub use mesh::TriangleMesh;
pub use nalgebra;
pub use ray::{Hit, Ray};
pub use rectangle::Rectangle;
pub use rigid_transform::RigidTransform;
