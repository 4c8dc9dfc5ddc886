//! The part of a capture that holds the object: what lies beyond costs nothing.

use imaging::{ExposureStack, Image, Mask};
use rayon::prelude::*;

use crate::depth::DepthMap;
use crate::solution::{Capture, NormalSolution};
use crate::view::{PixelRays, View};

/// What a [`Capture`] of a part borrows from.
pub(crate) struct Window {
    left: usize,
    top: usize,
    stack: ExposureStack,
    view: View,
    rays: PixelRays,
    pub(crate) mask: Mask,
}

impl Window {
    /// Around the mask, with even sides where the image allows it; none when the mask is empty, or when a light has no
    /// image: whoever looks at the whole capture says which.
    pub(crate) fn around(capture: &Capture<'_>, mask: &Mask) -> Option<Self> {
        let image = mask.as_image();
        if (image.width(), image.height()) != (capture.stack.width(), capture.stack.height()) {
            return None;
        }
        let ([left, top], [width, height]) = bounds(mask)?;
        let channels = capture.rig.channels();
        let lit = channels
            .iter()
            .filter_map(|&channel| Some((channel, capture.stack.light(channel)?)));
        let images: Vec<_> = std::iter::once((imaging::DARK_CHANNEL, capture.stack.dark()))
            .chain(lit)
            .collect();
        let crop = |(channel, image): &(u8, &Image<u16>)| Some((*channel, image.crop(left, top, width, height).ok()?));
        let images: Option<Vec<_>> = images.par_iter().map(crop).collect();
        let camera = capture.view.camera.crop(left, top, width, height).ok()?;
        Some(Self {
            left,
            top,
            stack: ExposureStack::new(&channels, images?, capture.stack.saturation()).ok()?,
            view: View {
                camera,
                base_from_camera: capture.view.base_from_camera,
            },
            rays: capture.rays.cropped(left, top, width, height)?,
            mask: Mask::from_nonzero(&image.crop(left, top, width, height).ok()?),
        })
    }

    /// As a capture under the lights of the whole one.
    pub(crate) fn capture<'a>(&'a self, whole: &Capture<'a>) -> Capture<'a> {
        Capture {
            stack: &self.stack,
            view: &self.view,
            rays: &self.rays,
            rig: whole.rig,
            noise: whole.noise,
        }
    }

    /// Normals at the size of the whole capture.
    pub(crate) fn whole_normals(&self, part: &NormalSolution, mask: &Mask) -> NormalSolution {
        let ((normals, albedo), ((confidence, residual), (shadows, lights_used))) = rayon::join(
            || {
                (
                    self.whole(&part.normals, [f32::NAN; 3], mask),
                    self.whole(&part.albedo, f32::NAN, mask),
                )
            },
            || {
                let confidence = self.whole(&part.confidence, 0.0, mask);
                let residual = self.whole(&part.residual, f32::NAN, mask);
                let shadows = self.whole(&part.shadows, 0, mask);
                (
                    (confidence, residual),
                    (shadows, self.whole(&part.lights_used, 0, mask)),
                )
            },
        );
        NormalSolution {
            normals,
            albedo,
            confidence,
            residual,
            shadows,
            lights_used,
            mask: mask.clone(),
            gain: part.gain,
        }
    }

    /// Depth at the size of the whole capture.
    pub(crate) fn whole_depth(&self, part: &DepthMap, mask: &Mask) -> DepthMap {
        DepthMap {
            depth: self.whole(&part.depth, f32::NAN, mask),
            parts: part.parts,
            iterations: part.iterations,
        }
    }

    fn whole<T: Copy>(&self, part: &Image<T>, beyond: T, mask: &Mask) -> Image<T> {
        let (width, height) = (mask.as_image().width(), mask.as_image().height());
        let mut whole = Image::filled(width, height, beyond);
        let rows = whole.pixels_mut().chunks_exact_mut(width).skip(self.top);
        for (row, source) in rows.zip(part.rows()) {
            row[self.left..self.left + source.len()].copy_from_slice(source);
        }
        whole
    }
}

/// Corner and size of the smallest rectangle around a mask with even corner and size, as far as the image reaches; none
/// when the mask is empty.
pub(crate) fn bounds(mask: &Mask) -> Option<([usize; 2], [usize; 2])> {
    let image = mask.as_image();
    let (mut left, mut right) = (image.width(), 0);
    let (mut top, mut bottom) = (image.height(), 0);
    for (y, row) in image.rows().enumerate() {
        let Some(first) = row.iter().position(|&value| value != 0) else {
            continue;
        };
        let last = row.iter().rposition(|&value| value != 0).unwrap_or(first);
        (left, right) = (left.min(first), right.max(last));
        (top, bottom) = (top.min(y), y);
    }
    if left > right {
        return None;
    }
    let even = |first: usize, last: usize, limit: usize| {
        let first = first / 2 * 2;
        (first, ((last + 1).next_multiple_of(2)).min(limit) - first)
    };
    let ((left, width), (top, height)) = (even(left, right, image.width()), even(top, bottom, image.height()));
    Some(([left, top], [width, height]))
}
