//! Why the simulation cannot run.

/// Every failure of this crate, by cause.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// A camera cannot be served.
    #[error(transparent)]
    GigeVision(#[from] gige_vision::GigeVisionError),
    /// Impossible geometry.
    #[error(transparent)]
    Geometry(#[from] geometry::GeometryError),
}
