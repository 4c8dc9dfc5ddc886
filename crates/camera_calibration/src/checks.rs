//! Whether a calibration may be used, and what to do when not.

/// What a calibration has to reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// Most root mean square distance between corners as they fall and as they were seen, pixels.
    pub rms_px: f64,
    /// Fewest views.
    pub views: usize,
    /// Least angle between the two views whose targets are turned furthest from each other, radians.
    pub tilt: f64,
    /// Least share of the image's cells with corners.
    pub coverage: f64,
    /// Most standard deviation of a focal length, as its share.
    pub focal_share: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            rms_px: 0.3,
            views: 8,
            tilt: 20_f64.to_radians(),
            coverage: 0.6,
            focal_share: 0.002,
        }
    }
}

/// A threshold that is not reached, with what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Shortfall {
    /// The model does not fit.
    #[error(
        "corners are {found:.3} px off (RMS), allowed are {allowed} px; worst is {worst}: look whether the target is flat, \
         its squares as large as said, and nothing moved while the image was taken, or leave that view out"
    )]
    Residual {
        /// Pixels.
        found: f64,
        /// Pixels.
        allowed: f64,
        /// Name of the worst view.
        worst: String,
    },
    /// Too few pictures.
    #[error("{found} views are used, needed are {needed}: take {more} more of the target at other places")]
    Views {
        /// Used.
        found: usize,
        /// Least.
        needed: usize,
        /// The difference.
        more: usize,
    },
    /// The target was always turned the same way.
    #[error(
        "the target's directions differ by {found:.0} degrees, needed are {needed:.0}: tilt it against the camera, to both \
         sides and up and down"
    )]
    Tilt {
        /// Degrees.
        found: f64,
        /// Degrees.
        needed: f64,
    },
    /// Parts of the image were never used.
    #[error("corners are in {found:.0} % of the image, needed are {needed:.0} %: move the target to the {towards}")]
    Coverage {
        /// Per cent of the cells.
        found: f64,
        /// Per cent.
        needed: f64,
        /// The emptiest part.
        towards: &'static str,
    },
    /// The views do not tell the focal length well.
    #[error(
        "the focal length is known to {found:.2} %, allowed are {allowed:.2} %: tilt the target more and change its distance"
    )]
    Focal {
        /// Standard deviation, per cent.
        found: f64,
        /// Per cent.
        allowed: f64,
    },
    /// The arm's poses and the camera's do not agree.
    #[error(
        "the target is {found:.2} mm off (RMS) between arm and camera, allowed are {allowed} mm; worst is {worst}: look \
         whether target and camera are fixed, the arm stood still, and its poses are those of the images"
    )]
    Place {
        /// Millimetres.
        found: f64,
        /// Millimetres.
        allowed: f64,
        /// Name of the worst view.
        worst: String,
    },
    /// The wrist hardly turned about a second axis.
    #[error(
        "the wrist turned by {found:.0} degrees about its second axis, needed are {needed:.0}: turn it about more than one axis"
    )]
    Turns {
        /// Degrees.
        found: f64,
        /// Degrees.
        needed: f64,
    },
    /// The pose found is not certain.
    #[error(
        "the pose is known to {found:.2} mm, allowed are {allowed} mm: take more views, turned further from each other"
    )]
    Pose {
        /// Standard deviation, millimetres.
        found: f64,
        /// Millimetres.
        allowed: f64,
    },
}
