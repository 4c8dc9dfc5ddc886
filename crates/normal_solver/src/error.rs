//! Why a capture was not solved, or the node not started.

/// Every failure of this node, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The ROS layer.
    #[error(transparent)]
    Ros(#[from] ros::Error),
    /// A parameter has no meaning here.
    #[error(transparent)]
    Parameter(#[from] ros::parameters::ParameterError),
    /// Lists that describe the lights do not fit together.
    #[error(
        "lights.directions holds {directions} numbers and lights.intensities {intensities}; \
         allowed: three numbers and one intensity per light, for 3 to 255 lights"
    )]
    LightLists {
        /// Length of `lights.directions`.
        directions: usize,
        /// Length of `lights.intensities`.
        intensities: usize,
    },
    /// The frame of the light directions is not connected to the base frame.
    #[error("the lights' frame {frame:?} cannot be placed in {base:?}: {problem}")]
    LightFrame {
        /// `lights.frame_id`.
        frame: String,
        /// `base_frame_id`.
        base: String,
        /// What is missing.
        #[source]
        problem: Box<ros::tf::TfError>,
    },
    /// An image has an encoding that carries no linear brightness.
    #[error("image {index} of the capture is encoded as {found:?}; allowed: mono16")]
    Encoding {
        /// Position in the sequence.
        index: u8,
        /// What the image says.
        found: String,
    },
    /// The images do not make an exposure stack.
    #[error(transparent)]
    Images(#[from] imaging::ImagingError),
    /// The lights or the images do not determine normals.
    #[error(transparent)]
    Photometric(#[from] photometric::PhotometricError),
    /// The calibration of the lights cannot be used.
    #[error("{path}: {problem}")]
    LightsFile {
        /// The file, or the parameter that names it.
        path: String,
        /// What is wrong.
        #[source]
        problem: Box<calibration_files::CalibrationFileError>,
    },
    /// Calibrated panels need to know where the camera is.
    #[error("the camera's frame {frame:?} cannot be placed in {base:?}: {problem}")]
    CameraFrame {
        /// Of the images.
        frame: String,
        /// `base_frame_id`.
        base: String,
        /// What is missing.
        #[source]
        problem: Box<ros::tf::TfError>,
    },
    /// Calibrated panels need to know the camera's lens.
    #[error("no camera_info of {camera} has come")]
    NoCameraInfo {
        /// The camera.
        camera: String,
    },
    /// The `camera_info` makes no sense.
    #[error(transparent)]
    Geometry(#[from] geometry::GeometryError),
}

/// Why a capture was not waited for.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    #[error("camera {found:?} is not one of those solved here: {known}")]
    Camera { found: String, known: String },
    #[error("no capture has come since the start, waited {waited:.1} s")]
    NoCapture { waited: f64 },
    #[error("capture {id:?} is not known, waited {waited:.1} s; known: {known}")]
    UnknownCapture { id: String, waited: f64, known: String },
}
