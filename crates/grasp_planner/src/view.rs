//! What a camera shows of a capture, as planning takes it.

use geometry::{PinholeCamera, RigidTransform};
use grasp::ViewInput;
use imaging::{Image, Mask};
use interfaces::sensor_msgs::msg::CameraInfo;
use interfaces::std_msgs::msg::Header;

use crate::convert;
use crate::error::ViewError;
use crate::joiner::{MAPS, Maps};

/// One solved view.
#[derive(Debug)]
pub(crate) struct SolvedView {
    pub(crate) camera: String,
    /// Of the results: stamp of the first image, optical frame.
    pub(crate) header: Header,
    lens: PinholeCamera,
    base_from_camera: RigidTransform,
    normals: Image<[f32; 3]>,
    confidence: Image<f32>,
    mask: Mask,
    depth: Image<f32>,
    edges: Mask,
    edge_confidence: Image<f32>,
}

impl SolvedView {
    pub(crate) fn read(
        camera: String,
        info: &CameraInfo,
        base_from_camera: RigidTransform,
        maps: &Maps,
    ) -> Result<Self, ViewError> {
        let [normals, confidence, mask, depth, edges, edge_confidence] = maps;
        Ok(Self {
            camera,
            header: normals.header.clone(),
            lens: convert::lens(info)?,
            base_from_camera,
            normals: convert::image(MAPS[0], normals)?,
            confidence: convert::image(MAPS[1], confidence)?,
            mask: Mask::from_nonzero(&convert::image(MAPS[2], mask)?),
            depth: convert::image(MAPS[3], depth)?,
            edges: Mask::from_nonzero(&convert::image(MAPS[4], edges)?),
            edge_confidence: convert::image(MAPS[5], edge_confidence)?,
        })
    }

    pub(crate) fn input(&self) -> ViewInput<'_> {
        ViewInput {
            name: &self.camera,
            camera: self.lens,
            base_from_camera: self.base_from_camera,
            normals: &self.normals,
            confidence: &self.confidence,
            edges: &self.edges,
            edge_confidence: &self.edge_confidence,
            mask: &self.mask,
            depth: Some(&self.depth),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use geometry::nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    /// A level plate of 60 x 60 mm, 10 mm over the table, seen from 0.3 m above its middle (0.4, 0, 0.01).
    pub(crate) fn plate(camera: &str) -> SolvedView {
        plate_at(camera, [0.4, 0.0])
    }

    /// The same with its middle elsewhere.
    pub(crate) fn plate_at(camera: &str, [x, y]: [f64; 2]) -> SolvedView {
        let looking_down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let is_plate = |x: usize, y: usize| (50..150).contains(&x) && (50..150).contains(&y);
        let image =
            |inside: f32, outside: f32| Image::from_fn(200, 200, |x, y| if is_plate(x, y) { inside } else { outside });
        SolvedView {
            camera: camera.into(),
            header: Header::default(),
            lens: PinholeCamera::new(200, 200, [500.0; 2], [99.5; 2]).expect("a lens"),
            base_from_camera: RigidTransform::from_parts(Vector3::new(x, y, 0.31), looking_down),
            normals: Image::from_fn(
                200,
                200,
                |x, y| {
                    if is_plate(x, y) { [0.0, 0.0, 1.0] } else { [f32::NAN; 3] }
                },
            ),
            confidence: image(0.9, 0.0),
            mask: Mask::from_nonzero(&image(1.0, 0.0).map(|inside| *inside as u8)),
            depth: image(0.3, f32::NAN),
            edges: Mask::from_nonzero(&Image::filled(200, 200, 0)),
            edge_confidence: image(0.0, 0.0),
        }
    }

    /// A plate with a disc on it whose outline has this radius in the image.
    pub(crate) fn disc(camera: &str, radius_px: f64) -> SolvedView {
        let is_outline = |x: usize, y: usize| ((x as f64 - 99.5).hypot(y as f64 - 99.5) - radius_px).abs() < 0.6;
        SolvedView {
            edges: Mask::from_nonzero(&Image::from_fn(200, 200, |x, y| u8::from(is_outline(x, y)))),
            edge_confidence: Image::filled(200, 200, 1.0),
            ..plate(camera)
        }
    }
}
