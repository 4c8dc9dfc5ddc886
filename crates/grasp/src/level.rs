//! A view at the resolution in which patches are looked for: a few cells across the cup.

use geometry::nalgebra::Point2;
use imaging::Mask;
use rayon::prelude::*;

use crate::view::ViewInput;

/// Means over square blocks of pixels, within the objects' bounding box.
#[derive(Debug, Clone)]
pub(crate) struct Level {
    /// Pixels along a block's side.
    pub(crate) factor: usize,
    /// First column and row of pixels.
    pub(crate) corner: [usize; 2],
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Row by row.
    pub(crate) cells: Vec<LevelCell>,
    /// Which object a cell belongs to, counted from 1; 0 is none.
    pub(crate) objects: Vec<u16>,
    /// Middle of each object's cells in pixels, and how many cells it has.
    pub(crate) object_middles: Vec<(Point2<f64>, usize)>,
    /// Object pixels in all.
    pub(crate) mask_pixels: usize,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LevelCell {
    /// Unit, or 0 where there is none.
    pub(crate) normal: [f32; 3],
    /// Mean confidence, a pixel without a normal or off the object counting 0; 0 where an edge is.
    pub(crate) weight: f32,
    /// Share of the cell on the object.
    pub(crate) inside: f32,
    /// Mean of the known depths, metres; NaN without any.
    pub(crate) depth: f32,
}

impl Level {
    pub(crate) fn empty() -> Self {
        Self {
            factor: 1,
            corner: [0, 0],
            width: 0,
            height: 0,
            cells: Vec::new(),
            objects: Vec::new(),
            object_middles: Vec::new(),
            mask_pixels: 0,
        }
    }

    pub(crate) fn new(input: &ViewInput<'_>, factor: usize) -> Self {
        let Some(([left, top], [right, bottom])) = bounds(input.mask) else {
            return Self::empty();
        };
        let width = (right - left).div_ceil(factor);
        let height = (bottom - top).div_ceil(factor);
        let row = |row: usize| {
            let rows = top + row * factor..(top + (row + 1) * factor).min(bottom);
            (0..width).map(move |column| {
                let first = left + column * factor;
                mean_cell(input, first..(first + factor).min(right), rows.clone(), factor)
            })
        };
        let rows: Vec<Vec<LevelCell>> = (0..height).into_par_iter().map(|y| row(y).collect()).collect();
        let mut level = Self {
            factor,
            corner: [left, top],
            width,
            height,
            cells: rows.concat(),
            ..Self::empty()
        };
        let inside: f32 = level.cells.iter().map(|cell| cell.inside).sum();
        level.mask_pixels = (inside * (factor * factor) as f32).round() as usize;
        level.label();
        level
    }

    /// The pixel position of a cell position; whole numbers are middles in both.
    pub(crate) fn pixel(&self, x: f64, y: f64) -> Point2<f64> {
        let scale = self.factor as f64;
        let at = |cell: f64, corner: usize| (cell + 0.5) * scale - 0.5 + corner as f64;
        Point2::new(at(x, self.corner[0]), at(y, self.corner[1]))
    }

    /// The cell position of a pixel position.
    pub(crate) fn cell(&self, pixel: &Point2<f64>) -> [f64; 2] {
        let scale = self.factor as f64;
        let at = |pixel: f64, corner: usize| (pixel + 0.5 - corner as f64) / scale - 0.5;
        [at(pixel.x, self.corner[0]), at(pixel.y, self.corner[1])]
    }

    /// The object at or next to a pixel; 0 is none.
    pub(crate) fn object_at(&self, pixel: &Point2<f64>) -> u16 {
        let [x, y] = self.cell(pixel).map(|position| position.round() as i64);
        let near = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)];
        let at = |(dx, dy): (i64, i64)| {
            let (x, y) = (x + dx, y + dy);
            let within = (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y);
            within.then(|| self.objects[y as usize * self.width + x as usize])
        };
        near.into_iter().filter_map(at).find(|object| *object > 0).unwrap_or(0)
    }

    /// Numbers the connected parts of the mask, by cells that are mostly inside.
    fn label(&mut self) {
        self.objects = vec![0; self.cells.len()];
        for start in 0..self.cells.len() {
            if self.objects[start] == 0 && self.cells[start].inside > 0.5 {
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
            let (x, y) = (at % self.width, at / self.width);
            sum = [sum[0] + x as f64, sum[1] + y as f64];
            count += 1;
            let neighbours = [
                (x > 0).then(|| at - 1),
                (x + 1 < self.width).then(|| at + 1),
                (y > 0).then(|| at - self.width),
                (y + 1 < self.height).then(|| at + self.width),
            ];
            for next in neighbours.into_iter().flatten() {
                if self.objects[next] == 0 && self.cells[next].inside > 0.5 {
                    self.objects[next] = object;
                    open.push(next);
                }
            }
        }
        let [x, y] = sum.map(|sum| sum / count as f64);
        (self.pixel(x, y), count)
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

fn mean_cell(
    input: &ViewInput<'_>,
    columns: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
    factor: usize,
) -> LevelCell {
    let mut normal = [0.0_f32; 3];
    let (mut weight, mut inside, mut edge_free) = (0.0_f32, 0_u32, true);
    let (mut depth, mut depths) = (0.0_f32, 0_u32);
    for y in rows {
        let masked = &input.mask.as_image().row(y)[columns.clone()];
        let edge = &input.edges.as_image().row(y)[columns.clone()];
        let normals = &input.normals.row(y)[columns.clone()];
        let confidence = &input.confidence.row(y)[columns.clone()];
        for (x, _) in masked.iter().enumerate().filter(|(_, inside)| **inside != 0) {
            inside += 1;
            edge_free &= edge[x] == 0;
            let trust = confidence[x];
            if normals[x][0].is_finite() && trust > 0.0 {
                normal = [0, 1, 2].map(|axis| normal[axis] + trust * normals[x][axis]);
                weight += trust;
            }
            let at = input.depth.map_or(f32::NAN, |image| image.row(y)[columns.start + x]);
            if at > 0.0 {
                depth += at;
                depths += 1;
            }
        }
    }
    let area = (factor * factor) as f32;
    let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
    LevelCell {
        normal: if length > 0.0 {
            normal.map(|x| x / length)
        } else {
            [0.0; 3]
        },
        // A line of edges must part the cells on its sides, even where it only clips their corners.
        weight: if edge_free { weight / area } else { 0.0 },
        inside: inside as f32 / area,
        depth: depth / depths as f32,
    }
}
