//! What one camera saw, and what is true of it.

use std::path::Path;

use half::f16;
use imaging::{DecodedPng, ExposureStack, Image, Mask, decode_png};
use photometric::View;

use crate::error::SceneError;
use crate::npz::read_array;

/// Raw values from here up are saturated: the captures' converter ends at 65,535 in steps of 16.
const SATURATION: u16 = 65_520;

/// One camera's images of a scene.
#[derive(Debug, Clone)]
pub struct CapturedView {
    /// `C1` or `C2`.
    pub camera: String,
    /// Where it was seen from.
    pub view: View,
    /// Dark and L1 to L7.
    pub stack: ExposureStack,
    /// The object.
    pub mask: Mask,
    /// None where the scene has none.
    pub truth: Option<Truth>,
}

/// What is true of a view.
#[derive(Debug, Clone)]
pub struct Truth {
    /// Unit vectors, base frame; NaN off all surfaces.
    pub normals: Image<[f32; 3]>,
    /// Along the optical axis, metres; NaN off all surfaces.
    pub depth: Image<f32>,
}

impl CapturedView {
    pub(crate) fn read(folder: &Path, camera: String, view: View) -> Result<Self, SceneError> {
        let channels = 1..=7_u8;
        let named = std::iter::once((0, "dark".to_owned())).chain(channels.map(|n| (n, format!("L{n}"))));
        let mut images = Vec::new();
        for (channel, name) in named {
            let path = folder.join(format!("{name}.png"));
            let DecodedPng::Gray16(image) = decode(&path)? else {
                return Err(SceneError::content(path, "not 16-bit gray"));
            };
            images.push((channel, image));
        }
        let stack = ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, SATURATION)
            .map_err(|error| SceneError::content(folder, error))?;
        let path = folder.join("mask.png");
        let DecodedPng::Gray8(mask) = decode(&path)? else {
            return Err(SceneError::content(path, "not 8-bit gray"));
        };
        mask.require_size_of(stack.dark(), "the mask")
            .map_err(|error| SceneError::content(path, error))?;
        let (width, height) = (stack.width(), stack.height());
        let truth = folder.join("gt.npz");
        let truth = truth.exists().then(|| Truth::read(&truth, width, height)).transpose()?;
        Ok(Self {
            camera,
            view,
            stack,
            mask: Mask::from_nonzero(&mask),
            truth,
        })
    }
}

impl Truth {
    fn read(path: &Path, width: usize, height: usize) -> Result<Self, SceneError> {
        let count = width * height;
        let components: Vec<f16> = read_array(path, "normal_world", 3 * count)?;
        let normals = components.as_chunks::<3>().0.iter().map(|&n| unit(n.map(f32::from)));
        let depths: Vec<f32> = read_array(path, "depth", count)?;
        let depths = depths.into_iter().map(|z| if z > 0.0 { z } else { f32::NAN });
        let wrong = |error| SceneError::content(path, error);
        Ok(Self {
            normals: Image::new(width, height, normals.collect()).map_err(wrong)?,
            depth: Image::new(width, height, depths.collect()).map_err(wrong)?,
        })
    }
}

/// Sixteen-bit floats are not quite of unit length.
fn unit(n: [f32; 3]) -> [f32; 3] {
    let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
    if length > 0.5 {
        n.map(|x| x / length)
    } else {
        [f32::NAN; 3]
    }
}

fn decode(path: &Path) -> Result<DecodedPng, SceneError> {
    let bytes = std::fs::read(path).map_err(|source| SceneError::Read {
        path: path.to_owned(),
        source,
    })?;
    decode_png(&bytes).map_err(|error| SceneError::content(path, error))
}
