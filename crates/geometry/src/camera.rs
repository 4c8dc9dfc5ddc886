//! The pinhole camera, optical frame: x right, y down, z forward.

use nalgebra::{Point2, Point3, Vector2, Vector3};

use crate::distortion::PlumbBob;
use crate::error::{GeometryError, require_finite};

/// An undistorted ray is accepted when it projects to within this of its pixel.
const UNPROJECT_TOLERANCE_PX: f64 = 1e-6;

/// A pinhole camera with `plumb_bob` distortion. An integer pixel position is the pixel's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PinholeCamera {
    width: usize,
    height: usize,
    focal: Vector2<f64>,
    principal: Vector2<f64>,
    distortion: PlumbBob,
}

impl PinholeCamera {
    /// A camera with a perfect lens; focal length and principal point in pixels, (x, y).
    pub fn new(width: usize, height: usize, focal: [f64; 2], principal: [f64; 2]) -> Result<Self, GeometryError> {
        if width == 0 || height == 0 {
            return Err(GeometryError::EmptyImage { width, height });
        }
        require_finite("focal length", &focal)?;
        require_finite("principal point", &principal)?;
        let [fx, fy] = focal;
        if fx <= 0.0 || fy <= 0.0 {
            return Err(GeometryError::FocalLength { fx, fy });
        }
        Ok(Self {
            width,
            height,
            focal: focal.into(),
            principal: principal.into(),
            distortion: PlumbBob::default(),
        })
    }

    /// From the values of a `CameraInfo`: row-major `k`, distortion model by name and its coefficients
    /// (k1, k2, p1, p2 and perhaps k3; none for a perfect lens).
    pub fn from_camera_info(
        width: usize,
        height: usize,
        k: &[f64; 9],
        distortion_model: &str,
        d: &[f64],
    ) -> Result<Self, GeometryError> {
        require_finite("camera matrix", k)?;
        require_finite("distortion coefficients", d)?;
        let [fx, skew, cx, zero_1, fy, cy, zero_2, zero_3, one] = *k;
        let camera = Self::new(width, height, [fx, fy], [cx, cy])?;
        if [skew, zero_1, zero_2, zero_3, one - 1.0].iter().any(|x| x.abs() > 1e-9) {
            return Err(GeometryError::CameraMatrix { k: *k });
        }
        Ok(camera.with_distortion(plumb_bob(distortion_model, d)?))
    }

    /// The same camera behind a distorting lens.
    #[must_use]
    pub fn with_distortion(mut self, distortion: PlumbBob) -> Self {
        self.distortion = distortion;
        self
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Focal length in pixels, (x, y).
    pub fn focal(&self) -> [f64; 2] {
        self.focal.into()
    }

    /// Principal point in pixels, (column, row).
    pub fn principal(&self) -> [f64; 2] {
        self.principal.into()
    }

    /// The lens.
    pub fn distortion(&self) -> PlumbBob {
        self.distortion
    }

    /// The pixel a point falls on, which may lie outside the image; none for points at or behind the camera.
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Option<Point2<f64>> {
        if point_in_camera.z <= 0.0 {
            return None;
        }
        let ideal = point_in_camera.xy().coords / point_in_camera.z;
        Some(Point2::from(
            self.distortion.distort(ideal).component_mul(&self.focal) + self.principal,
        ))
    }

    /// The ray through a pixel, in the camera frame with z = 1, so that depth (along z) times the ray is the point.
    ///
    /// Fails where the distortion folds over: there no single ray belongs to the pixel.
    pub fn unproject(&self, pixel: &Point2<f64>) -> Result<Vector3<f64>, GeometryError> {
        let distorted = (pixel.coords - self.principal).component_div(&self.focal);
        if self.distortion.is_none() {
            return Ok(distorted.push(1.0));
        }
        let scale = self.focal.max();
        let found = self
            .distortion
            .undistort(distorted, UNPROJECT_TOLERANCE_PX * 1e-3 / scale);
        let residual_px = found.residual * scale;
        // A NaN residual must fail too, hence the negation-free form.
        if residual_px <= UNPROJECT_TOLERANCE_PX && found.orientation_kept {
            return Ok(found.ideal.push(1.0));
        }
        let (u, v, iterations) = (pixel.x, pixel.y, found.iterations);
        Err(GeometryError::NotUndistortable {
            u,
            v,
            residual_px,
            iterations,
        })
    }

    /// The camera of a part of the image; the lens stays, the principal point moves.
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Result<Self, GeometryError> {
        let (image_width, image_height) = (self.width, self.height);
        let fits = |start: usize, length: usize, limit| start.checked_add(length).is_some_and(|end| end <= limit);
        if width == 0 || height == 0 || !fits(x, width, image_width) || !fits(y, height, image_height) {
            return Err(GeometryError::CropOutside {
                x,
                y,
                width,
                height,
                image_width,
                image_height,
            });
        }
        let principal = self.principal - Vector2::new(x as f64, y as f64);
        Ok(Self {
            width,
            height,
            principal,
            ..*self
        })
    }

    /// The camera of an image in which every pixel became `factor` x `factor` pixels.
    pub fn enlarged(&self, factor: usize) -> Result<Self, GeometryError> {
        let (width, height) = (self.width, self.height);
        match (width.checked_mul(factor), height.checked_mul(factor)) {
            (Some(width), Some(height)) if factor > 0 => Ok(self.scaled(width, height, factor as f64)),
            _ => Err(GeometryError::Scale { factor, width, height }),
        }
    }

    /// The camera of an image in which `factor` x `factor` pixels became one; the factor must divide the size.
    pub fn binned(&self, factor: usize) -> Result<Self, GeometryError> {
        let (width, height) = (self.width, self.height);
        if factor == 0 || !width.is_multiple_of(factor) || !height.is_multiple_of(factor) {
            return Err(GeometryError::Scale { factor, width, height });
        }
        Ok(self.scaled(width / factor, height / factor, 1.0 / factor as f64))
    }

    /// Pixel edges scale about the image's corner at (-0.5, -0.5), because integer positions are centres.
    fn scaled(&self, width: usize, height: usize, factor: f64) -> Self {
        let principal = self.principal.map(|c| (c + 0.5) * factor - 0.5);
        Self {
            width,
            height,
            focal: self.focal * factor,
            principal,
            distortion: self.distortion,
        }
    }
}

fn plumb_bob(model: &str, d: &[f64]) -> Result<PlumbBob, GeometryError> {
    match (model, d) {
        ("" | "plumb_bob", []) => Ok(PlumbBob::default()),
        ("plumb_bob", &[k1, k2, p1, p2]) => Ok(PlumbBob {
            k1,
            k2,
            p1,
            p2,
            k3: 0.0,
        }),
        ("plumb_bob", &[k1, k2, p1, p2, k3]) => Ok(PlumbBob { k1, k2, p1, p2, k3 }),
        _ => Err(GeometryError::DistortionModel {
            model: model.to_owned(),
            coefficients: d.len(),
        }),
    }
}
