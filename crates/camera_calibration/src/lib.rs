//! Cameras from pictures of a printed target: their lenses, where they are to each other, and where they sit on the arm or
//! over the table.
//!
//! [`TargetDetector`] finds a [`CharucoTarget`] in images. [`calibrate_cameras`] makes lenses and the cameras' places to
//! each other of what was found, [`calibrate_eye_in_hand`] and [`calibrate_eye_to_hand`] poses, with the arm's. Every
//! result says how well it fits, how sure its numbers are, and what to do when it may not be used.
//!
//! It is *not* a driver, moves no arm and reads no files; when images are taken and where the arm is then, is others'.
//!
//! ```
//! use camera_calibration::{CameraOptions, CameraViews, CharucoTarget, DetectedCorner, TargetView, calibrate_camera};
//! use geometry::{PinholeCamera, RigidTransform};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! // What a detector finds in ten images of a target that is tilted to all sides.
//! let (target, truth) = (CharucoTarget::A4, PinholeCamera::new(768, 768, [1090.0, 1091.0], [385.0, 381.5])?);
//! let view = |index: usize| {
//!     let angle = index as f64;
//!     let rotation = UnitQuaternion::from_scaled_axis(0.5 * Vector3::new(angle.cos(), angle.sin(), 0.0));
//!     let shift = Vector3::new(0.08 * angle.sin() - 0.1, 0.08 * angle.cos() - 0.07, 0.4);
//!     let camera_from_target = RigidTransform::from_parts(shift, rotation);
//!     let corner = |id| {
//!         let pixel = truth.project(&camera_from_target.transform_point(&target.corner(id)?))?;
//!         Some(DetectedCorner { id, pixel })
//!     };
//!     TargetView { name: format!("image {index}"), corners: (0..target.corner_count()).filter_map(corner).collect() }
//! };
//! let seen = CameraViews { camera: "c1".into(), size: [768, 768], views: (0..10).map(view).collect() };
//!
//! let found = calibrate_camera(&target, &seen, &CameraOptions::default())?;
//! assert!((found.camera.focal()[0] - 1090.0).abs() < 1e-3);
//! assert!(found.shortfalls.is_empty(), "{:?}", found.shortfalls);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bundle;
mod checks;
mod corner;
mod coverage;
mod detect;
mod drawing;
mod error;
mod hand_eye;
mod homography;
mod intrinsics;
mod lens;
mod levenberg;
mod mean;
mod saddle;
mod stereo;
mod target;
mod views;
mod zhang;

pub use checks::{Shortfall, Thresholds};
pub use coverage::{CELLS, Coverage};
pub use detect::{DetectedCorner, LEAST_CORNERS, NotFound, TargetDetector};
pub use error::CameraCalibrationError;
pub use hand_eye::{
    EyeInHand, EyeToHand, HandEyeReport, HandEyeThresholds, HandEyeView, SceneCamera, SceneView, calibrate_eye_in_hand,
    calibrate_eye_to_hand,
};
pub use intrinsics::{CameraCalibration, CameraOptions, LEAST_VIEWS, calibrate_camera};
pub use lens::{FixedLens, LensPart};
pub use stereo::{LEAST_COMMON, Placed, RigCalibration, calibrate_cameras};
pub use target::CharucoTarget;
pub use views::{CameraViews, TargetView, ViewReport};
