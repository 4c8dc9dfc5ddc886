//! Why the node was not started, and why a request was not met.

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
    /// A parameter whose values do not fit together.
    #[error("parameter {name}: {reason}")]
    Value {
        /// Of the parameter.
        name: &'static str,
        /// What was found and what is allowed.
        reason: String,
    },
    /// The arm's description cannot be used.
    #[error("description of the arm, {what}: {reason}")]
    Description {
        /// The file, or that it is the built-in one.
        what: String,
        /// What is wrong.
        reason: String,
    },
}

/// Why a view of a capture cannot be planned on.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ViewError {
    /// A map has an encoding that is not what its topic carries.
    #[error("{map} is encoded as {found:?}; allowed: {allowed}")]
    Encoding {
        map: &'static str,
        found: String,
        allowed: &'static str,
    },
    /// The pixels do not make an image.
    #[error("{map}: {problem}")]
    Pixels {
        map: &'static str,
        #[source]
        problem: imaging::ImagingError,
    },
    #[error("no camera_info has come")]
    NoCameraInfo,
    #[error("camera_info: {0}")]
    CameraInfo(#[from] geometry::GeometryError),
    #[error("its frame {frame:?} cannot be placed in {base:?}: {problem}")]
    Frame {
        frame: String,
        base: String,
        #[source]
        problem: Box<ros::tf::TfError>,
    },
}

/// Why there are no grasps, for people.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    #[error(
        "target is {name:?}, but named objects cannot be looked for: nothing here localises them; \
         leave it empty for whatever can be picked"
    )]
    Target { name: String },
    #[error("mode is {found}, allowed: 0 (SOLID) and 1 (THIN)")]
    Mode { found: u8 },
    #[error("direction is ({x}, {y}, {z}), allowed: finite, 0 or longer than 1e-6")]
    Direction { x: f64, y: f64, z: f64 },
    #[error("direction ({x}, {y}, {z}) comes from below the table")]
    FromBelow { x: f64, y: f64, z: f64 },
    #[error(
        "direction is {degrees:.0} degrees off straight down, but thin objects are taken from above; \
         allowed: {allowed:.0} degrees (parameter cone)"
    )]
    Sideways { degrees: f64, allowed: f64 },
    #[error("no capture has come since the start, waited {waited:.1} s")]
    NoCapture { waited: f64 },
    #[error("capture {id:?} is not known, waited {waited:.1} s; known: {known}")]
    UnknownCapture { id: String, waited: f64, known: String },
    #[error("capture {id:?} cannot be planned on: {reasons}")]
    NotSolved { id: String, reasons: String },
    #[error(transparent)]
    Settings(#[from] Error),
    #[error(transparent)]
    Grasp(#[from] grasp::GraspError),
}
