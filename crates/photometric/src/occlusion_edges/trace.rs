//! Regions of steps that hang together.

use imaging::Image;

/// What makes a region.
#[derive(Debug, Clone, Copy)]
pub(super) struct Thresholds {
    /// It begins where a step is stronger.
    pub(super) strong: u8,
    /// And ends where none is stronger.
    pub(super) weak: u8,
    /// Smaller ones are dropped.
    pub(super) least_pixels: usize,
}

/// Pixels in an image with a border of one pixel all around, so that every pixel has eight neighbours.
pub(super) struct Regions {
    pub(super) width: usize,
    pub(super) height: usize,
    /// 1 inside, 0 outside.
    pub(super) inside: Vec<u8>,
    /// Indices of all pixels inside.
    pub(super) pixels: Vec<usize>,
}

impl Regions {
    pub(super) fn empty(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            inside: vec![0; (width + 2) * (height + 2)],
            pixels: Vec::new(),
        }
    }

    /// Row length with the border.
    pub(super) fn stride(&self) -> usize {
        self.width + 2
    }

    /// Column and row of a pixel in the image itself.
    pub(super) fn place(&self, index: usize) -> (usize, usize) {
        (index % self.stride() - 1, index / self.stride() - 1)
    }
}

/// Groups of pixels over the weak threshold that have one over the strong threshold (hysteresis: Canny, "A computational
/// approach to edge detection", 1986, section IX); eight neighbours connect.
pub(super) fn regions(strengths: &Image<u8>, thresholds: Thresholds) -> Regions {
    let (width, height) = (strengths.width(), strengths.height());
    let mut regions = Regions::empty(width, height);
    let mut dropped = Vec::new();
    for (y, row) in strengths.rows().enumerate() {
        if row.iter().fold(0, |most, &strength| strength.max(most)) <= thresholds.strong {
            continue;
        }
        for (x, &strength) in row.iter().enumerate() {
            let index = (y + 1) * regions.stride() + x + 1;
            if strength > thresholds.strong && regions.inside[index] == 0 {
                let before = regions.pixels.len();
                grow(strengths, thresholds.weak, index, &mut regions);
                if regions.pixels.len() - before < thresholds.least_pixels {
                    dropped.extend(regions.pixels.drain(before..));
                }
            }
        }
    }
    for index in dropped {
        regions.inside[index] = 0;
    }
    regions
}

/// Adds the group of a pixel.
fn grow(strengths: &Image<u8>, weak: u8, start: usize, regions: &mut Regions) {
    let stride = regions.stride();
    let mut next = regions.pixels.len();
    regions.inside[start] = 1;
    regions.pixels.push(start);
    while let Some(&index) = regions.pixels.get(next) {
        next += 1;
        for neighbour in around(index, stride) {
            let (column, row) = (neighbour % stride, neighbour / stride);
            let strength = strengths.get(column.wrapping_sub(1), row.wrapping_sub(1));
            if strength.is_some_and(|&strength| strength > weak) && regions.inside[neighbour] == 0 {
                regions.inside[neighbour] = 1;
                regions.pixels.push(neighbour);
            }
        }
    }
}

/// Neighbours clockwise, from the one above.
pub(super) fn around(index: usize, stride: usize) -> [usize; 8] {
    let (above, below) = (index - stride, index + stride);
    [
        above,
        above + 1,
        index + 1,
        below + 1,
        below,
        below - 1,
        index - 1,
        above - 1,
    ]
}
