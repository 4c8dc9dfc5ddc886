//! A depth map as points.

use geometry::nalgebra::Vector3;
use imaging::Image;

use crate::view::{PixelRays, View};

/// A point of the surface; camera frame, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Where it is.
    pub position: [f32; 3],
    /// Unit normal; NaN where none is known.
    pub normal: [f32; 3],
}

/// Every pixel with a depth, row by row, as a point in the **camera's** frame; `normals` are in the base frame.
/// Images that differ in size give the points of the pixels they share in order.
pub fn surface_points(
    depth: &Image<f32>,
    normals: &Image<[f32; 3]>,
    view: &View,
    rays: &PixelRays,
) -> Vec<SurfacePoint> {
    let camera_from_base = view.base_from_camera.inverse().rotation_matrix().cast::<f32>();
    let pixels = depth.pixels().iter().zip(normals.pixels()).zip(rays.ideal().pixels());
    let point = |((&depth, &normal), &[x, y]): ((&f32, &[f32; 3]), &[f32; 2])| SurfacePoint {
        position: [x * depth, y * depth, depth],
        normal: (camera_from_base * Vector3::from(normal)).into(),
    };
    pixels.filter(|((depth, _), _)| depth.is_finite()).map(point).collect()
}
