//! Where a camera stands, and the ray of each of its pixels.

use geometry::nalgebra::{Matrix3, Point2, Point3, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::Image;
use rayon::prelude::*;

use crate::error::PhotometricError;

/// A camera at its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Lens and image.
    pub camera: PinholeCamera,
    /// Where it is; metres.
    pub base_from_camera: RigidTransform,
}

/// The rays of all pixels; made once for a camera, because undistorting a million pixels takes long.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelRays {
    /// x and y of each pixel's ray in the camera frame at z = 1; NaN where the lens model gives no ray.
    ideal: Image<[f32; 2]>,
}

impl PixelRays {
    /// Undistorts every pixel.
    pub fn new(camera: &PinholeCamera) -> Self {
        let (width, height) = (camera.width(), camera.height());
        let ray = |index: usize| {
            let pixel = Point2::new((index % width) as f64, (index / width) as f64);
            camera
                .unproject(&pixel)
                .map_or([f32::NAN; 2], |ray| [ray.x as f32, ray.y as f32])
        };
        let rays: Vec<[f32; 2]> = (0..width * height).into_par_iter().map(ray).collect();
        let mut ideal = Image::filled(width, height, [0.0_f32; 2]);
        ideal.pixels_mut().copy_from_slice(&rays);
        Self { ideal }
    }

    /// The rays of a part of the image; none when it reaches beyond.
    pub(crate) fn cropped(&self, x: usize, y: usize, width: usize, height: usize) -> Option<Self> {
        let ideal = self.ideal.crop(x, y, width, height).ok()?;
        Some(Self { ideal })
    }

    /// The rays of an image in which 2 x 2 pixels became one: their means.
    pub(crate) fn binned(&self) -> Self {
        let mean = |x: usize, y: usize| {
            let (above, below) = (self.ideal.row(2 * y), self.ideal.row(2 * y + 1));
            let four = [above[2 * x], above[2 * x + 1], below[2 * x], below[2 * x + 1]];
            [0, 1].map(|axis| four.iter().map(|ray| ray[axis]).sum::<f32>() / 4.0)
        };
        Self {
            ideal: Image::from_fn(self.ideal.width() / 2, self.ideal.height() / 2, mean),
        }
    }

    /// x and y at z = 1, camera frame.
    pub fn ideal(&self) -> &Image<[f32; 2]> {
        &self.ideal
    }
}

impl View {
    /// Refuses rays of another size.
    pub fn require_rays(&self, rays: &PixelRays) -> Result<(), PhotometricError> {
        let (width, height) = (rays.ideal.width(), rays.ideal.height());
        if (width, height) == (self.camera.width(), self.camera.height()) {
            return Ok(());
        }
        Err(PhotometricError::OtherSize {
            what: "the rays",
            width,
            height,
            expected_width: self.camera.width(),
            expected_height: self.camera.height(),
        })
    }

    /// Where the camera's centre is, base frame.
    pub fn centre(&self) -> Point3<f64> {
        Point3::from(self.base_from_camera.translation())
    }

    /// Turns camera axes into base axes.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.base_from_camera.rotation_matrix()
    }

    /// The point at a depth (along the optical axis, metres) on the ray `[x, y]` at z = 1; base frame.
    pub fn point_at_depth(&self, ideal: [f32; 2], depth: f64) -> Point3<f64> {
        let ray = Vector3::new(f64::from(ideal[0]), f64::from(ideal[1]), 1.0);
        self.base_from_camera.transform_point(&Point3::from(ray * depth))
    }

    /// Depth at which the ray `[x, y]` at z = 1 meets the level plane at a height over the table; NaN when it never
    /// does.
    pub fn depth_of_plane(&self, ideal: [f32; 2], height: f64) -> f64 {
        let ray = Vector3::new(f64::from(ideal[0]), f64::from(ideal[1]), 1.0);
        let down = self.base_from_camera.transform_direction(&ray).z;
        let depth = (height - self.centre().z) / down;
        if depth > 0.0 { depth } else { f64::NAN }
    }
}
