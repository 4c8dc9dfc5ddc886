//! Why the node cannot start, and why a capture gives no images.

use devices::CameraError;

use crate::join::Void;

/// Why the node did not start, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The ROS layer.
    #[error(transparent)]
    Ros(#[from] ros::Error),
    /// A parameter has no meaning here.
    #[error(transparent)]
    Parameter(#[from] ros::parameters::ParameterError),
    /// No camera, or one twice.
    #[error("parameter cameras is {found:?}; allowed: one name or more, each once")]
    Cameras {
        /// As given.
        found: Vec<String>,
    },
    /// A camera's parameters make no camera.
    #[error("camera {camera}: {problem}")]
    Camera {
        /// Its name.
        camera: String,
        /// What the driver or the calibration file says.
        #[source]
        problem: camera_aravis::CameraAravisError,
    },
    /// A camera's image parameters contradict each other.
    #[error("camera {camera}: {problem}")]
    Settings {
        /// Its name.
        camera: String,
        /// Value found and values allowed.
        problem: String,
    },
    /// A file of poses cannot be used.
    #[error("parameter {camera}.pose_file is {file:?}: {problem}")]
    PoseFile {
        /// Its name.
        camera: String,
        /// As given.
        file: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A camera's pose is no pose.
    #[error("parameter {camera}.pose is {found:?}: {problem}; allowed: x y z qx qy qz qw, or nothing")]
    Pose {
        /// Its name.
        camera: String,
        /// As given.
        found: Vec<f64>,
        /// What is wrong with it.
        problem: String,
    },
}

/// Why a capture gives no images, by cause.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum CaptureFailure {
    /// Asked for a camera that is not configured.
    #[error("there is no camera {name:?}; known: {known}")]
    UnknownCamera { name: String, known: String },
    /// More callers than anybody has reason to.
    #[error("{waiting} callers are waiting for captures already; try again")]
    Busy { waiting: usize },
    /// A camera is away; trying again at once would not help.
    #[error("{camera}: {problem}")]
    Unavailable { camera: String, problem: CameraError },
    /// A camera does not fit its parameters or its calibration.
    #[error("camera {camera}: {problem}")]
    Settings { camera: String, problem: String },
    /// It ran, and something was not as it should be.
    #[error("the capture is void: {0}")]
    Void(#[from] Void),
}
