//! What can be wrong with a calibration's input.

use geometry::GeometryError;

/// Why nothing was calibrated, with what was found and what is needed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CameraCalibrationError {
    /// A target that cannot be.
    #[error("target: {what} is {value}, allowed are {allowed}")]
    Target {
        /// The number.
        what: &'static str,
        /// As given.
        value: f64,
        /// In words.
        allowed: String,
    },
    /// The detector refuses the board.
    #[error("target: {reason}")]
    Board {
        /// In its words.
        reason: String,
    },
    /// Too few views that differ.
    #[error(
        "{camera}: {found} views can be used, needed are {needed} at least{}",
        reasons(left_out)
    )]
    FewViews {
        /// Whose.
        camera: String,
        /// Usable ones.
        found: usize,
        /// Least number.
        needed: usize,
        /// Name and reason of those that cannot be used.
        left_out: Vec<String>,
    },
    /// The closed form has no solution: views that are parallel, or not views of this target.
    #[error(
        "{camera}: no lens explains the {views} views; tilt the target against the camera, differently in each, and look \
         whether it is the one that was named"
    )]
    NoLens {
        /// Whose.
        camera: String,
        /// Usable ones.
        views: usize,
    },
    /// Parallel targets do not tell the focal length.
    #[error(
        "{camera}: in all {views} views the target is turned the same way (within {degrees:.1} degrees, needed are more than \
         {needed:.0}), which does not tell the focal length; tilt it, differently in each"
    )]
    Parallel {
        /// Whose.
        camera: String,
        /// Usable ones.
        views: usize,
        /// Largest angle between two.
        degrees: f64,
        /// Least angle.
        needed: f64,
    },
    /// Cameras that hardly saw the target together.
    #[error(
        "{first} and {other} saw the target together in {found} views, needed are {needed}: put it where both see it"
    )]
    FewCommon {
        /// The first camera.
        first: String,
        /// The other one.
        other: String,
        /// Common views.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// The wrist turned about one axis only, or not at all.
    #[error(
        "the wrist turned by {found:.1} degrees about its second axis, needed are {needed:.0} at least: turn it about two axes \
         that differ, else the camera may be anywhere along the first"
    )]
    OneAxis {
        /// Degrees.
        found: f64,
        /// Degrees.
        needed: f64,
    },
    /// The scene camera never saw a target whose place is known.
    #[error("{camera} saw the target at no place that the camera on the arm saw as well")]
    NoPlacement {
        /// The scene camera.
        camera: String,
    },
    /// The normal matrix is singular.
    #[error("the views do not determine {what}")]
    Undetermined {
        /// In words.
        what: &'static str,
    },
    /// The fit ended in numbers that no camera has.
    #[error("the fit ended in no camera: {0}")]
    Geometry(#[from] GeometryError),
}

fn reasons(left_out: &[String]) -> String {
    if left_out.is_empty() {
        String::new()
    } else {
        format!(" (left out: {})", left_out.join("; "))
    }
}
