//! The YAML file that ROS's `camera_calibration` writes and camera drivers read.

mod document;
mod scale;

use std::path::{Path, PathBuf};

use geometry::{GeometryError, PinholeCamera};

use crate::CameraAravisError;
use document::{Document, Matrix};

/// A calibrated camera, as `camera_calibration` writes it: the values of a `CameraInfo`, checked.
///
/// ```
/// use camera_aravis::CalibrationFile;
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("c1.yaml");
/// # let path = path.to_str().unwrap();
///
/// let camera = geometry::PinholeCamera::new(1536, 1536, [2181.8, 2181.8], [767.5, 767.5])?;
/// CalibrationFile::new("c1", &camera).write(path)?;
/// let read = CalibrationFile::read(path)?;
/// assert_eq!((read.width(), read.camera()), (1536, &camera));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationFile {
    camera_name: String,
    width: u32,
    height: u32,
    camera_matrix: [f64; 9],
    distortion_model: String,
    distortion_coefficients: Vec<f64>,
    rectification_matrix: [f64; 9],
    projection_matrix: [f64; 12],
    camera: PinholeCamera,
}

impl CalibrationFile {
    /// A single camera: no rectification, and a projection that is the camera matrix.
    pub fn new(camera_name: impl Into<String>, camera: &PinholeCamera) -> Self {
        let ([fx, fy], [cx, cy], lens) = (camera.focal(), camera.principal(), camera.distortion());
        Self {
            camera_name: camera_name.into(),
            width: camera.width() as u32,
            height: camera.height() as u32,
            camera_matrix: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            distortion_model: "plumb_bob".into(),
            distortion_coefficients: vec![lens.k1, lens.k2, lens.p1, lens.p2, lens.k3],
            rectification_matrix: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            projection_matrix: [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            camera: *camera,
        }
    }

    /// Reads and checks a file. URLs are refused, for they would need a ROS installation to mean anything.
    pub fn read(path: &str) -> Result<Self, CameraAravisError> {
        let path = plain_path(path)?;
        let text = std::fs::read_to_string(path).map_err(|source| file_error(path, "read it", source))?;
        Self::parse(&text, path)
    }

    /// Checks the text of a file; `path` is where it is from.
    pub fn parse(text: &str, path: &Path) -> Result<Self, CameraAravisError> {
        let document: Document = serde_yaml_ng::from_str(text).map_err(|error| CameraAravisError::Yaml {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
        let at = Place(path);
        let (width, height) = (at.side("image_width", document.image_width)?, {
            at.side("image_height", document.image_height)?
        });
        let camera_matrix = at.matrix("camera_matrix", (3, 3), &document.camera_matrix)?;
        let rectification_matrix = at.matrix("rectification_matrix", (3, 3), &document.rectification_matrix)?;
        let projection_matrix = at.matrix("projection_matrix", (3, 4), &document.projection_matrix)?;
        let coefficients = at.coefficients(&document.distortion_coefficients)?;
        let size = (width as usize, height as usize);
        let camera = PinholeCamera::from_camera_info(
            size.0,
            size.1,
            &camera_matrix,
            &document.distortion_model,
            &coefficients,
        )
        .map_err(|error| at.geometry(&error))?;
        at.projection(&projection_matrix)?;
        Ok(Self {
            camera_name: document.camera_name,
            width,
            height,
            camera_matrix,
            distortion_model: document.distortion_model,
            distortion_coefficients: coefficients,
            rectification_matrix,
            projection_matrix,
            camera,
        })
    }

    /// Writes the file, whole or not at all.
    pub fn write(&self, path: &str) -> Result<(), CameraAravisError> {
        let path = plain_path(path)?;
        let mut beside = path.as_os_str().to_owned();
        beside.push(".part");
        let beside = PathBuf::from(beside);
        std::fs::write(&beside, self.to_yaml())
            .and_then(|()| std::fs::rename(&beside, path))
            .map_err(|source| file_error(path, "write it", source))
    }

    /// The text of the file.
    pub fn to_yaml(&self) -> String {
        document::write(&Document {
            image_width: i64::from(self.width),
            image_height: i64::from(self.height),
            camera_name: self.camera_name.clone(),
            camera_matrix: Matrix::new((3, 3), &self.camera_matrix),
            distortion_model: self.distortion_model.clone(),
            distortion_coefficients: Matrix::new(
                (1, self.distortion_coefficients.len()),
                &self.distortion_coefficients,
            ),
            rectification_matrix: Matrix::new((3, 3), &self.rectification_matrix),
            projection_matrix: Matrix::new((3, 4), &self.projection_matrix),
        })
    }

    /// Name of the camera.
    pub fn camera_name(&self) -> &str {
        &self.camera_name
    }

    /// Calibrated columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Calibrated rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// K of a `CameraInfo`: row-major, pixels.
    pub fn camera_matrix(&self) -> &[f64; 9] {
        &self.camera_matrix
    }

    /// "`plumb_bob`".
    pub fn distortion_model(&self) -> &str {
        &self.distortion_model
    }

    /// D of a `CameraInfo`: k1, k2, p1, p2 and perhaps k3, or none.
    pub fn distortion_coefficients(&self) -> &[f64] {
        &self.distortion_coefficients
    }

    /// R of a `CameraInfo`, row-major.
    pub fn rectification_matrix(&self) -> &[f64; 9] {
        &self.rectification_matrix
    }

    /// P of a `CameraInfo`, row-major, 3 x 4.
    pub fn projection_matrix(&self) -> &[f64; 12] {
        &self.projection_matrix
    }

    /// The same camera for calculations.
    pub fn camera(&self) -> &PinholeCamera {
        &self.camera
    }
}

fn plain_path(path: &str) -> Result<&Path, CameraAravisError> {
    let reason = if path.trim().is_empty() {
        "it is empty"
    } else if path.starts_with("package://") {
        "packages are not searched for"
    } else if path.contains("://") {
        "URLs are not read"
    } else {
        return Ok(Path::new(path));
    };
    Err(CameraAravisError::Url {
        url: path.to_owned(),
        reason,
    })
}

fn file_error(path: &Path, action: &'static str, source: std::io::Error) -> CameraAravisError {
    CameraAravisError::File {
        path: path.to_owned(),
        action,
        source,
    }
}

/// The file that is being checked, for what is said about it.
struct Place<'a>(&'a Path);

impl Place<'_> {
    fn refuse(&self, key: &'static str, found: String, allowed: impl Into<String>) -> CameraAravisError {
        CameraAravisError::Calibration {
            path: self.0.to_owned(),
            key,
            found,
            allowed: allowed.into(),
        }
    }

    fn side(&self, key: &'static str, found: i64) -> Result<u32, CameraAravisError> {
        match u32::try_from(found) {
            Ok(side @ 1..=65536) => Ok(side),
            _ => Err(self.refuse(key, found.to_string(), "1 to 65536 pixels")),
        }
    }

    fn matrix<const N: usize>(
        &self,
        key: &'static str,
        (rows, cols): (usize, usize),
        matrix: &Matrix,
    ) -> Result<[f64; N], CameraAravisError> {
        let values = <[f64; N]>::try_from(matrix.data.as_slice());
        match values {
            Ok(values) if (matrix.rows, matrix.cols) == (rows, cols) => self.finite(key, &values).map(|()| values),
            _ => {
                let allowed = format!("{rows} x {cols} with {N} numbers");
                Err(self.refuse(key, matrix.shape(), allowed))
            }
        }
    }

    fn coefficients(&self, matrix: &Matrix) -> Result<Vec<f64>, CameraAravisError> {
        let key = "distortion_coefficients";
        if matrix.rows * matrix.cols != matrix.data.len() || (matrix.rows > 1 && matrix.cols > 1) {
            return Err(self.refuse(key, matrix.shape(), "one row with as many numbers as columns"));
        }
        self.finite(key, &matrix.data)?;
        Ok(matrix.data.clone())
    }

    fn finite(&self, key: &'static str, values: &[f64]) -> Result<(), CameraAravisError> {
        match values.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(self.refuse(key, format!("{value} in {values:?}"), "finite numbers")),
            None => Ok(()),
        }
    }

    fn projection(&self, p: &[f64; 12]) -> Result<(), CameraAravisError> {
        if p[0] > 0.0 && p[5] > 0.0 && p[8..] == [0.0, 0.0, 1.0, 0.0] {
            return Ok(());
        }
        let allowed = "[fx 0 cx Tx, 0 fy cy Ty, 0 0 1 0] with positive fx and fy";
        Err(self.refuse("projection_matrix", format!("{p:?}"), allowed))
    }

    /// What the camera's geometry refuses belongs to one of two keys.
    fn geometry(&self, error: &GeometryError) -> CameraAravisError {
        match error {
            GeometryError::DistortionModel { model, coefficients } => {
                let found = format!("{model:?} with {coefficients} coefficients");
                self.refuse("distortion_model", found, "\"plumb_bob\" with 0, 4 or 5 coefficients")
            }
            error => self.refuse(
                "camera_matrix",
                error.to_string(),
                "[fx 0 cx, 0 fy cy, 0 0 1] with positive fx and fy",
            ),
        }
    }
}
