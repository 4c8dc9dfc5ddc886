//! Why the simulation cannot run.

use std::path::PathBuf;

/// Every failure of this crate, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// A camera cannot be served.
    #[error(transparent)]
    GigeVision(#[from] gige_vision::GigeVisionError),
    /// The simulated light controller.
    #[error(transparent)]
    Board(#[from] crate::board::BoardError),
    /// The simulated arm.
    #[error(transparent)]
    Arm(#[from] crate::arm::ArmError),
    /// The arm's collision shapes.
    #[error(transparent)]
    Collision(#[from] collision::CollisionError),
    /// Impossible geometry.
    #[error(transparent)]
    Geometry(#[from] geometry::GeometryError),
    /// An impossible image.
    #[error(transparent)]
    Imaging(#[from] imaging::ImagingError),
    /// A camera that cannot be.
    #[error("camera {name}: {reason}")]
    Camera {
        /// Its name.
        name: String,
        /// What is wrong with it.
        reason: gige_vision::GigeVisionError,
    },
    /// A camera's view is not there, and will not be soon.
    #[error("no view of camera {camera} after {waited:.1?}: {reason}")]
    NotRendered {
        /// Its name.
        camera: String,
        /// How long was waited.
        waited: std::time::Duration,
        /// What the renderer says.
        reason: String,
    },
    /// A value that a world cannot have.
    #[error("{place} is {found}; allowed is {allowed}")]
    Value {
        /// Where it stands, from the world file's top.
        place: String,
        /// As given.
        found: String,
        /// In words.
        allowed: String,
    },
    /// A world file is not what it should be.
    #[error("{}: {reason}", path.display())]
    World {
        /// The world file.
        path: PathBuf,
        /// What is wrong with its content.
        reason: Box<SimError>,
    },
    /// A world's text cannot be read.
    #[error(transparent)]
    Yaml(#[from] serde_yaml_ng::Error),
    /// A file cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    ReadFile {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        reason: std::io::Error,
    },
    /// A mesh file that is no mesh.
    #[error("{}, {place}: {reason}", path.display())]
    Mesh {
        /// The mesh file.
        path: PathBuf,
        /// Where in it.
        place: String,
        /// What is wrong there.
        reason: String,
    },
}

impl SimError {
    pub(crate) fn value(place: impl Into<String>, found: impl Into<String>, allowed: impl Into<String>) -> Self {
        Self::Value {
            place: place.into(),
            found: found.into(),
            allowed: allowed.into(),
        }
    }

    /// Says where the value stands that is wrong.
    #[must_use]
    pub(crate) fn within(self, outer: &str) -> Self {
        match self {
            Self::Value { place, found, allowed } => Self::Value {
                place: format!("{outer}.{place}"),
                found,
                allowed,
            },
            other => other,
        }
    }
}
