//! What can be wrong with values that describe geometry.

/// Why a transform or a camera was refused, with what was given and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// A number is NaN or infinite.
    #[error("{what} must be finite, got {value:?}")]
    NotFinite {
        /// The quantity.
        what: &'static str,
        /// All its components.
        value: Vec<f64>,
    },
    /// A quaternion is too far from unit length to be a rotation; a forgotten one is all zero.
    #[error("quaternion (x, y, z, w) = {xyzw:?} has length {length:.6}, allowed is 1 ± {tolerance}")]
    QuaternionNotUnit {
        /// As given, in the order x, y, z, w.
        xyzw: [f64; 4],
        /// Its Euclidean length.
        length: f64,
        /// Largest deviation from 1.
        tolerance: f64,
    },
    /// The upper left 3 x 3 of a matrix is no rotation.
    #[error("matrix is not a rigid transform: {reason} (deviation {deviation:.3e}, allowed {tolerance:.0e})")]
    NotRigid {
        /// Which property fails.
        reason: &'static str,
        /// By how much.
        deviation: f64,
        /// Allowed deviation.
        tolerance: f64,
    },
    /// A camera needs at least one pixel.
    #[error("image size {width} x {height} has no pixels")]
    EmptyImage {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Focal lengths are pixels and positive.
    #[error("focal length ({fx}, {fy}) px must be positive; an uncalibrated camera sends zeros")]
    FocalLength {
        /// Along x.
        fx: f64,
        /// Along y.
        fy: f64,
    },
    /// The camera matrix has entries a pinhole camera without skew cannot have.
    #[error("camera matrix {k:?} is not of the form [fx 0 cx, 0 fy cy, 0 0 1]")]
    CameraMatrix {
        /// Row-major, as given.
        k: [f64; 9],
    },
    /// Only `plumb_bob` with 0, 4 or 5 coefficients is understood.
    #[error("distortion model {model:?} with {coefficients} coefficients; understood is \"plumb_bob\" with 0, 4 or 5")]
    DistortionModel {
        /// As given.
        model: String,
        /// How many came with it.
        coefficients: usize,
    },
    /// A crop must lie inside the image.
    #[error("crop of {width} x {height} at ({x}, {y}) leaves the image of {image_width} x {image_height}")]
    CropOutside {
        /// First column.
        x: usize,
        /// First row.
        y: usize,
        /// Columns wanted.
        width: usize,
        /// Rows wanted.
        height: usize,
        /// Columns there are.
        image_width: usize,
        /// Rows there are.
        image_height: usize,
    },
    /// Scaling by a factor that is zero, or binning that does not divide the image.
    #[error("scale factor {factor} does not fit an image of {width} x {height}")]
    Scale {
        /// As given.
        factor: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// No ray maps to this pixel, or the search for it did not end: the distortion folds over there.
    #[error(
        "pixel ({u:.2}, {v:.2}) cannot be undistorted: residual {residual_px:.3e} px after {iterations} iterations"
    )]
    NotUndistortable {
        /// Column.
        u: f64,
        /// Row.
        v: f64,
        /// Distance between the pixel and the projection of the best ray found.
        residual_px: f64,
        /// Newton steps taken.
        iterations: usize,
    },
    /// A triangle names a corner that is not there.
    #[error("triangle {triangle} uses vertex {vertex}, there are {vertices}")]
    VertexIndex {
        /// Position of the triangle in its mesh.
        triangle: usize,
        /// The vertex it uses.
        vertex: u32,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// More triangles than indices of 31 bits can name.
    #[error("mesh has {triangles} triangles, allowed are {allowed}")]
    TooManyTriangles {
        /// As given.
        triangles: usize,
        /// Most that are understood.
        allowed: usize,
    },
}

/// Passes finite numbers through and names the others.
pub(crate) fn require_finite(what: &'static str, value: &[f64]) -> Result<(), GeometryError> {
    if value.iter().all(|x| x.is_finite()) {
        Ok(())
    } else {
        Err(GeometryError::NotFinite {
            what,
            value: value.to_vec(),
        })
    }
}
