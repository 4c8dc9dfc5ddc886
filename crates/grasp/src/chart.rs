//! A view's measurements laid out on a tangent plane, in metres: there a cup's footprint is a circle in every view.

use geometry::nalgebra::{Matrix5, Point3, Vector2, Vector3, Vector5};

use crate::directions::across;
use crate::region::Region;
use crate::specks::open_specks;
use crate::view::View;

/// A plane with axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tangent {
    pub(crate) origin: Point3<f64>,
    pub(crate) u: Vector3<f64>,
    pub(crate) v: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
}

impl Tangent {
    pub(crate) fn new(origin: Point3<f64>, normal: Vector3<f64>) -> Self {
        let [u, v] = across(&normal);
        Self { origin, u, v, normal }
    }

    pub(crate) fn at(&self, x: f64, y: f64) -> Point3<f64> {
        self.origin + self.u * x + self.v * y
    }

    pub(crate) fn moved(&self, along_normal: f64) -> Self {
        Self {
            origin: self.origin + self.normal * along_normal,
            ..*self
        }
    }
}

/// How a chart is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    /// Metres between cells.
    pub(crate) pitch: f64,
    /// Cells from the middle to the border.
    pub(crate) half: usize,
}

impl Grid {
    pub(crate) fn side(&self) -> usize {
        2 * self.half + 1
    }

    /// Metres from the middle to the border.
    pub(crate) fn reach(&self) -> f64 {
        self.pitch * self.half as f64
    }

    /// Position of a cell, metres.
    pub(crate) fn position(&self, index: usize) -> [f64; 2] {
        let at = |cell: usize| (cell as f64 - self.half as f64) * self.pitch;
        [at(index % self.side()), at(index / self.side())]
    }

    /// Column and row, with fractions, of a position.
    pub(crate) fn cell(&self, x: f64, y: f64) -> [f64; 2] {
        [x, y].map(|at| at / self.pitch + self.half as f64)
    }
}

/// One cell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ChartCell {
    /// Unit in the chart's axes (u, v, normal); 0 where there is none.
    pub(crate) normal: [f32; 3],
    pub(crate) confidence: f32,
    /// Share of the cell on the object or the patch; 0.5 where an edge ends the patch.
    pub(crate) inside: f32,
    /// Cosine between the plane's normal and those of half of the cell at least; 0 where less is on the object.
    pub(crate) facing: f32,
}

/// One pixel of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChartEdge {
    /// Metres.
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) weight: f64,
}

/// What belongs to a patch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part<'a> {
    pub(crate) region: &'a Region,
    /// Between normals and the plane's.
    pub(crate) least_cosine: f64,
    /// Cells are read at places that differ by view.
    pub(crate) seed: u64,
}

/// What one view says on a plane.
#[derive(Debug, Clone)]
pub(crate) struct Chart {
    pub(crate) tangent: Tangent,
    pub(crate) grid: Grid,
    pub(crate) cells: Vec<ChartCell>,
    pub(crate) edges: Vec<ChartEdge>,
    /// Pixels per square metre of the plane, at its origin.
    pub(crate) density: f64,
    /// A point that stands over the plane is seen this many times its height beside its place.
    pub(crate) slide: Vector2<f64>,
}

impl ChartCell {
    /// Normal times presence, and presence.
    fn values(&self) -> [f32; 4] {
        let [u, v, n] = self.normal.map(|axis| axis * self.inside);
        [u, v, n, self.inside]
    }
}

impl Chart {
    /// All that a view shows there, or only the part of a patch whose normals are within an angle of the plane's, which is
    /// the same part in every view.
    pub(crate) fn new(view: &View<'_>, tangent: Tangent, grid: Grid, only: Option<Part<'_>>) -> Self {
        let sight = tangent.origin - view.centre;
        let along = sight.dot(&tangent.normal);
        let slide = -Vector2::new(sight.dot(&tangent.u), sight.dot(&tangent.v)) / along;
        let density = view.jacobian(&tangent.origin).map_or(0.0, |[a, b]| {
            let across = |row: &Vector3<f64>| [row.dot(&tangent.u), row.dot(&tangent.v)];
            let ([au, av], [bu, bv]) = (across(&a), across(&b));
            (au * bv - av * bu).abs()
        });
        let cells = cells(view, &tangent, grid, only);
        Self {
            tangent,
            grid,
            cells,
            edges: edges(view, &tangent, grid.reach()),
            density,
            slide,
        }
    }

    /// Normals and presence of each cell, blurred by the binomial filter 1 4 6 4 1 in both directions: interpolated between
    /// sharp cells, a border would look blunter than at the cells, and a sweep would stop there.
    pub(crate) fn blurred(&self) -> Blurred {
        let side = self.grid.side();
        let mut values: Vec<[f32; 4]> = self.cells.iter().map(ChartCell::values).collect();
        for stride in [1, side] {
            let along = |index: usize| if stride == 1 { index % side } else { index / side };
            let blur = |index: usize| {
                let mut sum = [0.0; 4];
                for (tap, weight) in [1.0, 4.0, 6.0, 4.0, 1.0].into_iter().enumerate() {
                    if (2..side + 2).contains(&(along(index) + tap)) {
                        let value = &values[index + tap * stride - 2 * stride];
                        for (sum, value) in sum.iter_mut().zip(value) {
                            *sum += weight / 16.0 * value;
                        }
                    }
                }
                sum
            };
            values = (0..values.len()).map(blur).collect();
        }
        Blurred {
            grid: self.grid,
            slide: self.slide,
            values,
        }
    }

    /// By cell: on the object with a normal within an angle of the plane's, or a speck (square metres) in such a surface.
    pub(crate) fn open(&self, least_cosine: f64, speck: f64) -> Vec<bool> {
        let mut open: Vec<bool> = (0..self.cells.len())
            .map(|index| self.is_open(index, least_cosine))
            .collect();
        open_specks(&mut open, self.grid.side(), self.grid.pitch, speck);
        open
    }

    /// On the object with a normal within an angle of the plane's.
    fn is_open(&self, index: usize, least_cosine: f64) -> bool {
        f64::from(self.cells[index].facing) >= least_cosine
    }
}

/// What a chart's cells hold, blurred: normal times presence, and presence.
#[derive(Debug, Clone)]
pub(crate) struct Blurred {
    pub(crate) grid: Grid,
    /// As the chart's.
    pub(crate) slide: Vector2<f64>,
    values: Vec<[f32; 4]>,
}

impl Blurred {
    /// Normal (times presence) and presence; nothing outside.
    pub(crate) fn interpolated(&self, x: f64, y: f64) -> [f32; 4] {
        interpolated(&self.grid, [x, y], |index| self.values[index])
    }
}

fn interpolated(grid: &Grid, at: [f64; 2], value: impl Fn(usize) -> [f32; 4]) -> [f32; 4] {
    let [column, row] = grid.cell(at[0], at[1]);
    let side = grid.side();
    let last = (side - 1) as f64;
    if !(0.0..last).contains(&column) || !(0.0..last).contains(&row) {
        return [0.0; 4];
    }
    let (left, top) = (column as usize, row as usize);
    let (fx, fy) = ((column - left as f64) as f32, (row - top as f64) as f32);
    let mut sum = [0.0; 4];
    for (offset, weight) in [
        (0, (1.0 - fx) * (1.0 - fy)),
        (1, fx * (1.0 - fy)),
        (side, (1.0 - fx) * fy),
        (side + 1, fx * fy),
    ] {
        let value = value(top * side + left + offset);
        for (sum, value) in sum.iter_mut().zip(value) {
            *sum += weight * value;
        }
    }
    sum
}

/// Every so many cells are enough for five numbers.
const FIT_STRIDE: usize = 3;

/// A surface that bends evenly over its tangent plane: height `(a x² + 2 b x y + c y²) / 2`, from slopes alone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Bend {
    a: f64,
    b: f64,
    c: f64,
}

impl Bend {
    /// Least squares over the open cells of some charts within a radius; flat where there are too few.
    pub(crate) fn fit(charts: &[&Chart], least_cosine: f64, radius: f64) -> Self {
        let (mut left, mut right, mut count) = (Matrix5::zeros(), Vector5::zeros(), 0_usize);
        for chart in charts {
            for (index, cell) in chart.cells.iter().enumerate().step_by(FIT_STRIDE) {
                let [x, y] = chart.grid.position(index);
                if x * x + y * y > radius * radius || !chart.is_open(index, least_cosine) {
                    continue;
                }
                let [nu, nv, n] = cell.normal.map(f64::from);
                // Slopes at the middle are unknown as well: the plane's normal is only nearly the surface's.
                for (row, slope) in [
                    (Vector5::new(1.0, 0.0, x, y, 0.0), -nu / n),
                    (Vector5::new(0.0, 1.0, 0.0, x, y), -nv / n),
                ] {
                    left += row * row.transpose();
                    right += row * slope;
                }
                count += 1;
            }
        }
        let solved = left.cholesky().filter(|_| count > 20).map(|left| left.solve(&right));
        solved.map_or(Self::default(), |solution| Self {
            a: solution[2],
            b: solution[3],
            c: solution[4],
        })
    }

    /// Metres over the plane.
    pub(crate) fn height(&self, x: f64, y: f64) -> f64 {
        (self.a * x * x + 2.0 * self.b * x * y + self.c * y * y) / 2.0
    }

    /// Normal in the plane's axes, any length.
    pub(crate) fn normal(&self, x: f64, y: f64) -> Vector3<f64> {
        Vector3::new(-(self.a * x + self.b * y), -(self.b * x + self.c * y), 1.0)
    }
}

/// Somewhere in a cell, -0.5 to 0.5 of it, always the same: a border that runs along the cells would else be moved by up
/// to half a cell in all of them at once, and by as much in both views where they are read alike.
fn jitter(index: usize, seed: u64) -> [f64; 2] {
    // The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
    let mut bits = (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ seed.wrapping_mul(0xD1B5_4A32_D192_ED03);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^= bits >> 31;
    [bits >> 32, bits & 0xFFFF_FFFF].map(|part| part as f64 / f64::from(u32::MAX) - 0.5)
}

fn cells(view: &View<'_>, tangent: &Tangent, grid: Grid, only: Option<Part<'_>>) -> Vec<ChartCell> {
    let (rotation, shift) = view.camera_from_base();
    let middle = rotation * tangent.origin.coords + shift;
    let axes = [&tangent.u, &tangent.v, &tangent.normal];
    let [u, v, _] = axes.map(|axis| rotation * axis);
    let single = axes.map(|axis| axis.map(|x| x as f32));
    let read = |[x, y]: [f64; 2]| {
        let pixel = view.input.camera.project(&Point3::from(middle + u * x + v * y))?;
        let (column, row) = view.fine.holding(&pixel)?;
        let share = only.map_or(1.0, |part| part.region.share(&view.fine, column, row));
        let cell = &view.fine.cells[row * view.fine.width + column];
        if share <= 0.0 || cell.inside <= 0.5 || cell.confidence <= 0.0 {
            return None;
        }
        let normal = Vector3::from(cell.normal);
        let normal = single.map(|axis| normal.dot(&axis));
        if only.is_some_and(|part| f64::from(normal[2]) < part.least_cosine) {
            return None;
        }
        Some(ChartCell {
            normal,
            confidence: cell.confidence,
            inside: share,
            facing: if share > 0.5 { normal[2] } else { 0.0 },
        })
    };
    let cell = |index: usize| {
        let [x, y] = grid.position(index);
        let at = |[right, up]: [f64; 2]| read([x + right * grid.pitch, y + up * grid.pitch]);
        match only {
            Some(part) => at(jitter(index, part.seed)).unwrap_or_default(),
            None => mean(QUARTERS.map(at)),
        }
    };
    (0..grid.side() * grid.side()).map(cell).collect()
}

/// Middles of a cell's quarters: what noise does to one of them is not the cell's.
const QUARTERS: [[f64; 2]; 4] = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];

/// Normal by confidence; nothing counts 0 for confidence and presence. A border through the middle leaves two quarters.
fn mean(parts: [Option<ChartCell>; 4]) -> ChartCell {
    let mut facing = parts.map(|part| part.map_or(0.0, |part| part.facing));
    facing.sort_by(f32::total_cmp);
    let mut sum = ChartCell {
        facing: facing[2],
        ..ChartCell::default()
    };
    for part in parts.into_iter().flatten() {
        for (sum, axis) in sum.normal.iter_mut().zip(part.normal) {
            *sum += axis * part.confidence;
        }
        sum.confidence += part.confidence / 4.0;
        sum.inside += part.inside / 4.0;
    }
    let length = sum.normal.iter().map(|axis| axis * axis).sum::<f32>().sqrt();
    if length > 0.0 {
        sum.normal = sum.normal.map(|axis| axis / length);
    }
    sum
}

fn edges(view: &View<'_>, tangent: &Tangent, reach: f64) -> Vec<ChartEdge> {
    let offset = (tangent.origin - view.centre).dot(&tangent.normal);
    let from = view.centre - tangent.origin;
    let (fx, fy) = (from.dot(&tangent.u), from.dot(&tangent.v));
    let on_plane = |edge: &crate::view::EdgePixel| {
        let along = edge.ray.dot(&tangent.normal);
        let distance = offset / along;
        if !(distance > 0.0 && distance.is_finite()) {
            return None;
        }
        let (x, y) = (
            fx + distance * edge.ray.dot(&tangent.u),
            fy + distance * edge.ray.dot(&tangent.v),
        );
        let weight = f64::from(edge.weight);
        (x.abs() <= reach && y.abs() <= reach).then_some(ChartEdge { x, y, weight })
    };
    view.edges.iter().filter_map(on_plane).collect()
}
