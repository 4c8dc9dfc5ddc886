//! What a capture's folder holds: images, masks, and which panel reaches which pixel.

use std::path::Path;

use anyhow::{Context, bail};
use imaging::{DecodedPng, Image, decode_png};

use super::npz;

/// Images of a capture, in the order of [`Truth::images`].
pub(super) const NAMES: [&str; 8] = ["L1", "L2", "L3", "L4", "L5", "L6", "L7", "dark"];

/// A capture and what is known about it.
pub(super) struct Truth {
    /// L1 to L7, then the ambient light alone; digital numbers.
    pub(super) images: Vec<Image<u16>>,
    /// 255 on the object.
    mask: Image<u8>,
    /// 128 on what the object stands on; none where it stands on the mat.
    labels: Option<Image<u8>>,
    /// Which panel reaches which pixel; none for hemispheres, which cast no shadow on themselves.
    shadows: Option<Shadows>,
    /// Per pixel, for printed objects.
    pub(super) albedo: Option<Vec<f32>>,
}

/// Panel by panel, row by row.
struct Shadows {
    visibility: Vec<u8>,
    /// Packed bits, the first one highest.
    attached: Vec<u8>,
}

/// What is seen in a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    Object,
    /// What the object stands on.
    Support,
    /// Mat and table.
    Room,
}

impl Truth {
    pub(super) fn read(folder: &Path, [width, height]: [usize; 2]) -> anyhow::Result<Self> {
        let images = NAMES.map(|name| sixteen_bit(&folder.join(format!("{name}.png"))));
        let mask = eight_bit(&folder.join("mask.png"))?;
        let labels = folder.join("labels.png");
        let truth = Self {
            images: images.into_iter().collect::<anyhow::Result<_>>()?,
            mask,
            labels: labels.exists().then(|| eight_bit(&labels)).transpose()?,
            shadows: Shadows::read(&folder.join("shadow.npz"), width * height)?,
            albedo: albedo(&folder.join("albedo.npz"), width * height)?,
        };
        let expected = Image::filled(width, height, 0_u8);
        for (image, name) in truth.images.iter().zip(NAMES) {
            image.require_size_of(&expected, name)?;
        }
        for mask in [&truth.mask].into_iter().chain(&truth.labels) {
            mask.require_size_of(&expected, "mask or labels")?;
        }
        Ok(truth)
    }

    pub(super) fn seen(&self, pixel: usize) -> Seen {
        let label = self.labels.as_ref().map_or(0, |labels| labels.pixels()[pixel]);
        match (self.mask.pixels()[pixel], label) {
            (0, 128) => Seen::Support,
            (0, _) => Seen::Room,
            _ => Seen::Object,
        }
    }

    /// Whether a panel reaches a pixel; none where the capture does not say.
    pub(super) fn reaches(&self, panel: usize, pixel: usize) -> Option<bool> {
        let shadows = self.shadows.as_ref()?;
        let index = panel * self.mask.pixels().len() + pixel;
        let attached = shadows.attached[index / 8] >> (7 - index % 8) & 1;
        Some(shadows.visibility[index] > 0 && attached == 0)
    }
}

impl Shadows {
    fn read(path: &Path, pixels: usize) -> anyhow::Result<Option<Self>> {
        if !path.exists() {
            return Ok(None);
        }
        Ok(Some(Self {
            visibility: npz::read(path, "visibility", 7 * pixels)?,
            attached: npz::read(path, "attached", (7 * pixels).div_ceil(8))?,
        }))
    }
}

fn albedo(path: &Path, pixels: usize) -> anyhow::Result<Option<Vec<f32>>> {
    if !path.exists() {
        return Ok(None);
    }
    let albedo: Vec<half::f16> = npz::read(path, "albedo", pixels)?;
    Ok(Some(albedo.into_iter().map(f32::from).collect()))
}

fn decode(path: &Path) -> anyhow::Result<DecodedPng> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    decode_png(&bytes).with_context(|| format!("cannot decode {}", path.display()))
}

fn sixteen_bit(path: &Path) -> anyhow::Result<Image<u16>> {
    let DecodedPng::Gray16(image) = decode(path)? else {
        bail!("{} is not 16-bit gray", path.display());
    };
    Ok(image)
}

fn eight_bit(path: &Path) -> anyhow::Result<Image<u8>> {
    let DecodedPng::Gray8(image) = decode(path)? else {
        bail!("{} is not 8-bit gray", path.display());
    };
    Ok(image)
}
