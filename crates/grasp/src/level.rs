//! A view in blocks of pixels: fine ones that charts read, coarse ones in which patches are looked for.

use geometry::nalgebra::Point2;
use imaging::Mask;
use rayon::prelude::*;

use crate::view::ViewInput;

/// Means over square blocks of pixels, within the objects' bounding box.
#[derive(Debug, Clone, Default)]
pub(crate) struct Blocks {
    /// Pixels along a block's side.
    pub(crate) factor: usize,
    /// First column and row of pixels.
    corner: [usize; 2],
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row.
    pub(crate) cells: Vec<Cell>,
}

/// One block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cell {
    /// Unit, or 0 where there is none.
    pub(crate) normal: [f32; 3],
    /// Mean confidence, a pixel without a normal or off the object counting 0.
    pub(crate) confidence: f32,
    /// Share of the cell on the object.
    pub(crate) inside: f32,
    /// Mean of the known depths, metres; NaN without any.
    pub(crate) depth: f32,
    pub(crate) has_edge: bool,
}

impl Blocks {
    pub(crate) fn new(input: &ViewInput<'_>, factor: usize) -> Self {
        let Some(([left, top], [right, bottom])) = bounds(input.mask) else {
            return Self::default();
        };
        let width = (right - left).div_ceil(factor);
        let height = (bottom - top).div_ceil(factor);
        let row = |row: usize| {
            let rows = top + row * factor..(top + (row + 1) * factor).min(bottom);
            let cell = |column: usize| {
                let first = left + column * factor;
                Mean::of_pixels(input, first..(first + factor).min(right), rows.clone()).cell(factor * factor)
            };
            (0..width).map(cell).collect::<Vec<_>>()
        };
        Self {
            factor,
            corner: [left, top],
            width,
            height,
            cells: (0..height).into_par_iter().flat_map_iter(row).collect(),
        }
    }

    /// Blocks of several blocks.
    pub(crate) fn coarser(&self, by: usize) -> Self {
        let (width, height) = (self.width.div_ceil(by), self.height.div_ceil(by));
        let cell = |index: usize| {
            let (left, top) = (index % width * by, index / width * by);
            let mut mean = Mean::default();
            for y in top..(top + by).min(self.height) {
                for x in left..(left + by).min(self.width) {
                    mean.add(&self.cells[y * self.width + x]);
                }
            }
            mean.cell(by * by)
        };
        Self {
            factor: self.factor * by,
            corner: self.corner,
            width,
            height,
            cells: (0..width * height).map(cell).collect(),
        }
    }

    /// The pixel position of a cell position; whole numbers are middles in both.
    pub(crate) fn pixel(&self, x: f64, y: f64) -> Point2<f64> {
        let scale = self.factor as f64;
        let at = |cell: f64, corner: usize| (cell + 0.5) * scale - 0.5 + corner as f64;
        Point2::new(at(x, self.corner[0]), at(y, self.corner[1]))
    }

    /// The cell position of a pixel position.
    pub(crate) fn cell(&self, pixel: &Point2<f64>) -> [f64; 2] {
        let scale = self.factor.max(1) as f64;
        let at = |pixel: f64, corner: usize| (pixel + 0.5 - corner as f64) / scale - 0.5;
        [at(pixel.x, self.corner[0]), at(pixel.y, self.corner[1])]
    }

    /// Column and row of the block that holds a pixel; none outside of all.
    pub(crate) fn holding(&self, pixel: &Point2<f64>) -> Option<(usize, usize)> {
        let [x, y] = self.cell(pixel).map(|position| position + 0.5);
        let within = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        within.then_some((x as usize, y as usize))
    }

    /// The four cells beside one; none beyond the border.
    pub(crate) fn neighbours(&self, at: usize) -> impl Iterator<Item = Option<usize>> + use<> {
        let column = at % self.width;
        [
            (column > 0).then(|| at - 1),
            (column + 1 < self.width).then(|| at + 1),
            at.checked_sub(self.width),
            Some(at + self.width).filter(|&below| below < self.cells.len()),
        ]
        .into_iter()
    }
}

/// The blocks in which patches are looked for: a few across the cup.
#[derive(Debug, Clone, Default)]
pub(crate) struct Level {
    pub(crate) blocks: Blocks,
    /// Which object a cell belongs to, counted from 1; 0 is none.
    objects: Vec<u16>,
    /// Middle of each object's cells in pixels, and how many cells it has.
    pub(crate) object_middles: Vec<(Point2<f64>, usize)>,
    /// Object pixels in all.
    pub(crate) mask_pixels: usize,
}

impl Level {
    pub(crate) fn new(blocks: Blocks) -> Self {
        let inside: f32 = blocks.cells.iter().map(|cell| cell.inside).sum();
        let mut level = Self {
            mask_pixels: (inside * (blocks.factor * blocks.factor) as f32).round() as usize,
            blocks,
            ..Self::default()
        };
        level.label();
        level
    }

    /// The object at or next to a pixel; 0 is none.
    pub(crate) fn object_at(&self, pixel: &Point2<f64>) -> u16 {
        let cell = self.blocks.holding(pixel);
        cell.map_or(0, |(x, y)| self.object_near(y * self.blocks.width + x))
    }

    /// The object of a cell or, at an object's border, of a neighbour, counted from 1; 0 is none.
    pub(crate) fn object_near(&self, cell: usize) -> u16 {
        let neighbours = self.blocks.neighbours(cell).flatten();
        let mut near = std::iter::once(cell).chain(neighbours).map(|cell| self.objects[cell]);
        near.find(|object| *object > 0).unwrap_or(0)
    }

    /// The object that a cell belongs to, counted from 1; 0 is none.
    pub(crate) fn object_of(&self, index: usize) -> u16 {
        self.objects[index]
    }

    /// Numbers the connected parts of the mask, by cells that are mostly inside.
    fn label(&mut self) {
        self.objects = vec![0; self.blocks.cells.len()];
        for start in 0..self.blocks.cells.len() {
            if self.objects[start] == 0 && self.blocks.cells[start].inside > 0.5 {
                let object = (self.object_middles.len() + 1).min(usize::from(u16::MAX)) as u16;
                let middle = self.flood(start, object);
                self.object_middles.push(middle);
            }
        }
    }

    fn flood(&mut self, start: usize, object: u16) -> (Point2<f64>, usize) {
        let (mut sum, mut count) = ([0.0_f64; 2], 0_usize);
        let mut open = vec![start];
        self.objects[start] = object;
        while let Some(at) = open.pop() {
            let (x, y) = (at % self.blocks.width, at / self.blocks.width);
            sum = [sum[0] + x as f64, sum[1] + y as f64];
            count += 1;
            for next in self.blocks.neighbours(at).flatten() {
                if self.objects[next] == 0 && self.blocks.cells[next].inside > 0.5 {
                    self.objects[next] = object;
                    open.push(next);
                }
            }
        }
        let [x, y] = sum.map(|sum| sum / count as f64);
        (self.blocks.pixel(x, y), count)
    }
}

/// First and one past the last column and row of the mask.
fn bounds(mask: &Mask) -> Option<([usize; 2], [usize; 2])> {
    let rows: Vec<Option<(usize, usize)>> = {
        let image = mask.as_image();
        let extent = |y: usize| {
            let row = image.row(y);
            let first = row.iter().position(|&value| value != 0)?;
            let last = row.iter().rposition(|&value| value != 0)?;
            Some((first, last + 1))
        };
        (0..image.height()).into_par_iter().map(extent).collect()
    };
    let top = rows.iter().position(Option::is_some)?;
    let bottom = rows.iter().rposition(Option::is_some)? + 1;
    let left = rows.iter().flatten().map(|row| row.0).min()?;
    let right = rows.iter().flatten().map(|row| row.1).max()?;
    Some(([left, top], [right, bottom]))
}

/// Sums on the way to means.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    normal: [f32; 3],
    confidence: f32,
    inside: f32,
    depth: f32,
    depths: f32,
    has_edge: bool,
}

impl Mean {
    fn of_pixels(input: &ViewInput<'_>, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Self {
        let mut mean = Self::default();
        for y in rows {
            let masked = &input.mask.as_image().row(y)[columns.clone()];
            let edge = &input.edges.as_image().row(y)[columns.clone()];
            let normals = &input.normals.row(y)[columns.clone()];
            let confidence = &input.confidence.row(y)[columns.clone()];
            for (x, _) in masked.iter().enumerate().filter(|(_, inside)| **inside != 0) {
                mean.inside += 1.0;
                mean.has_edge |= edge[x] != 0;
                mean.add_normal(normals[x], confidence[x]);
                mean.add_depth(input.depth.map_or(f32::NAN, |image| image.row(y)[columns.start + x]));
            }
        }
        mean
    }

    fn add(&mut self, cell: &Cell) {
        self.inside += cell.inside;
        self.has_edge |= cell.has_edge;
        self.add_normal(cell.normal, cell.confidence);
        self.add_depth(cell.depth);
    }

    fn add_normal(&mut self, normal: [f32; 3], confidence: f32) {
        if normal[0].is_finite() && confidence > 0.0 {
            let trust = confidence.min(1.0);
            self.normal = [0, 1, 2].map(|axis| self.normal[axis] + trust * normal[axis]);
            self.confidence += trust;
        }
    }

    fn add_depth(&mut self, depth: f32) {
        if depth > 0.0 {
            self.depth += depth;
            self.depths += 1.0;
        }
    }

    fn cell(&self, count: usize) -> Cell {
        let length = self.normal.iter().map(|x| x * x).sum::<f32>().sqrt();
        Cell {
            normal: if length > 0.0 {
                self.normal.map(|x| x / length)
            } else {
                [0.0; 3]
            },
            confidence: self.confidence / count as f32,
            inside: self.inside / count as f32,
            depth: self.depth / self.depths,
            has_edge: self.has_edge,
        }
    }
}
