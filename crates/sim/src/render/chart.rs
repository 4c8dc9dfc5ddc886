//! Division of the scene's surfaces into patches of even light.

use std::collections::HashMap;

use geometry::nalgebra::{Point3, Vector3};

use super::direct::Origin;
use super::rectangle::Rectangle;
use super::stage::{LIFT, Place, Stage};
use crate::scene::Albedo;

/// About how many patches all bodies are divided into.
const BODY_PATCHES: f64 = 6000.0;
/// Least side of a body's patch, metres: finer is not seen.
const LEAST_PATCH: f64 = 0.001;
/// A chart has about this many times the cells that its triangles fill, whatever their shape.
const SPARSE: f64 = 4.0;
/// How many patches a rectangle of the room is divided into at most.
const RECTANGLE_PATCHES: f64 = 1500.0;
/// Triangles that are taken together lie in cubes of this many sides of a patch: a cube holds several patches.
const COARSE: f64 = 2.0;
/// Places of a patch that stand for all of it.
const SPOTS: usize = 2;
/// Samples at a triangle's border are drawn this share of the way to its middle, out of the corners with others.
const INWARDS: f64 = 0.05;

/// A piece of surface.
#[derive(Debug, Clone, Default)]
pub(super) struct Patch {
    /// Places on it and their normals; none for patches that are not there, outside a plane's triangles.
    pub(super) spots: Vec<Origin>,
    /// Mean share of light that it reflects.
    pub(super) albedo: f64,
}

/// Square cells on a plane.
#[derive(Debug, Clone)]
struct Chart {
    origin: Point3<f64>,
    axes: [Vector3<f64>; 2],
    cell: f64,
    columns: usize,
    rows: usize,
    /// Number of the patch of the first cell.
    first: u32,
}

impl Chart {
    fn cell(&self, point: &Point3<f64>) -> usize {
        let offset = point - self.origin;
        let [column, row] = self.axes.map(|axis| (offset.dot(&axis) / self.cell).max(0.0) as usize);
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    fn middle(&self, cell: usize) -> Point3<f64> {
        let along = |index: usize| (index as f64 + 0.5) * self.cell;
        let (right, up) = (along(cell % self.columns), along(cell / self.columns));
        self.origin + self.axes[0] * right + self.axes[1] * up
    }

    fn cells(&self) -> usize {
        self.columns * self.rows
    }
}

/// Where a surface's patches are.
#[derive(Debug, Clone, Copy)]
enum Division {
    /// It has none: it is black.
    None,
    /// It lies in one patch.
    Within(u32),
    /// It is divided by a chart.
    Chart(u32),
}

/// All patches.
pub(super) struct Atlas {
    pub(super) patches: Vec<Patch>,
    charts: Vec<Chart>,
    /// By surface.
    divisions: Vec<Division>,
}

impl Atlas {
    pub(super) fn new(stage: &Stage<'_>) -> Self {
        let mut atlas = Self {
            patches: Vec::new(),
            charts: Vec::new(),
            divisions: vec![Division::None; stage.facets.len() + stage.rectangles.len()],
        };
        atlas.divide_bodies(stage);
        for (index, rectangle) in stage.rectangles.iter().enumerate() {
            if rectangle.panel.is_none() {
                atlas.divisions[stage.facets.len() + index] = atlas.divide_rectangle(rectangle);
            }
        }
        atlas
    }

    /// The patch on which a place lies; none on what is black.
    pub(super) fn patch(&self, place: &Place) -> Option<u32> {
        match self.divisions[place.surface as usize] {
            _ if !place.front => None,
            Division::None => None,
            Division::Within(patch) => Some(patch),
            Division::Chart(chart) => {
                let chart = &self.charts[chart as usize];
                Some(chart.first + chart.cell(&place.point) as u32)
            }
        }
    }

    fn divide_rectangle(&mut self, rectangle: &Rectangle) -> Division {
        let size = rectangle.half.map(|half| 2.0 * half);
        let cell = (size[0] * size[1] / RECTANGLE_PATCHES).sqrt();
        let corner = rectangle.at(rectangle.half.map(|half| -half));
        let division = self.add_chart(corner, [rectangle.right, rectangle.up], cell, size);
        if let Some(chart) = self.charts.last() {
            for cell in 0..chart.cells() {
                let patch = &mut self.patches[chart.first as usize + cell];
                patch.albedo = rectangle.albedo;
                patch.spots = vec![Origin {
                    point: chart.middle(cell) + rectangle.normal * LIFT,
                    normal: rectangle.normal,
                }];
            }
        }
        division
    }

    fn add_chart(&mut self, origin: Point3<f64>, axes: [Vector3<f64>; 2], cell: f64, size: [f64; 2]) -> Division {
        let [columns, rows] = size.map(|side| ((side / cell).ceil() as usize).max(1));
        self.charts.push(Chart {
            origin,
            axes,
            cell,
            columns,
            rows,
            first: self.patches.len() as u32,
        });
        self.patches
            .resize(self.patches.len() + columns * rows, Patch::default());
        Division::Chart((self.charts.len() - 1) as u32)
    }

    /// Planes larger than a patch get a chart; small triangles that face the same way are taken together.
    fn divide_bodies(&mut self, stage: &Stage<'_>) {
        let area: f64 = (0..stage.facets.len()).map(|t| stage.area(t)).sum();
        let cell = (area / BODY_PATCHES).sqrt().max(LEAST_PATCH);
        let mut groups = Groups::default();
        for triangles in planes(stage) {
            let (origin, axes, size) = frame(stage, &triangles);
            if size[0].max(size[1]) <= cell {
                for &triangle in &triangles {
                    self.divisions[triangle] = groups.add(&mut self.patches, stage, triangle, cell);
                }
                continue;
            }
            let filled = triangles.iter().map(|&t| stage.area(t)).sum::<f64>() / (cell * cell);
            let coarse = coarsened(cell, size, SPARSE * (filled + 1.0));
            let division = self.add_chart(origin, axes, coarse, size);
            for &triangle in &triangles {
                self.divisions[triangle] = division;
                self.add_spots(stage, triangle);
            }
        }
        groups.spread(&mut self.patches, stage);
    }

    /// Gives the cells that a triangle reaches into a place on it.
    fn add_spots(&mut self, stage: &Stage<'_>, triangle: usize) {
        let Some(chart) = self.charts.last() else { return };
        let facet = &stage.facets[triangle];
        let corners = stage.mesh.corners(triangle);
        let middle = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
        let [low, high] = cell_range(chart, &corners);
        for row in low[1]..=high[1] {
            for column in low[0]..=high[0] {
                let cell = row * chart.columns + column;
                let nearest = nearest(&chart.middle(cell), &corners);
                let patch = &mut self.patches[chart.first as usize + cell];
                if patch.spots.len() < SPOTS && chart.cell(&nearest) == cell {
                    let point = nearest + (middle - nearest) * INWARDS + facet.normal * LIFT;
                    let normal = facet.normal;
                    patch.spots.push(Origin { point, normal });
                    patch.albedo = mean_albedo(stage, facet.body);
                }
            }
        }
    }
}

/// A side of cells of which no more than `most` cover a rectangle.
fn coarsened(mut cell: f64, size: [f64; 2], most: f64) -> f64 {
    let count = |cell: f64| size.map(|side| (side / cell).ceil().max(1.0)).iter().product::<f64>();
    while count(cell) > most.max(1.0) {
        cell *= 1.5;
    }
    cell
}

/// First and last column and row of the cells around a triangle.
fn cell_range(chart: &Chart, corners: &[Point3<f64>; 3]) -> [[usize; 2]; 2] {
    let cells = corners.map(|corner| chart.cell(&corner));
    let along = |pick: fn(usize, usize) -> usize| {
        let (low, high) = cells.iter().fold((usize::MAX, 0), |(low, high), &cell| {
            let at = pick(cell, chart.columns);
            (low.min(at), high.max(at))
        });
        [low, high]
    };
    let ([left, right], [top, bottom]) = (along(|a, b| a % b), along(|a, b| a / b));
    [[left, top], [right, bottom]]
}

fn mean_albedo(stage: &Stage<'_>, body: usize) -> f64 {
    match stage.scene.bodies[body].albedo {
        Albedo::Uniform(albedo) => albedo,
        Albedo::Print { range: [low, high], .. } => f64::midpoint(low, high),
    }
}

/// Triangles of each plane, in the order in which the planes begin.
fn planes(stage: &Stage<'_>) -> Vec<Vec<usize>> {
    let mut position = HashMap::new();
    let mut planes: Vec<Vec<usize>> = Vec::new();
    for (triangle, facet) in stage.facets.iter().enumerate() {
        let at = *position.entry(facet.plane).or_insert(planes.len());
        if at == planes.len() {
            planes.push(Vec::new());
        }
        planes[at].push(triangle);
    }
    planes
}

/// A rectangle around triangles that lie in one plane: a corner, two axes and the sides.
fn frame(stage: &Stage<'_>, triangles: &[usize]) -> (Point3<f64>, [Vector3<f64>; 2], [f64; 2]) {
    let corners = stage.mesh.corners(triangles[0]);
    let normal = stage.facets[triangles[0]].normal;
    let along = (corners[1] - corners[0]).try_normalize(0.0).unwrap_or_else(Vector3::x);
    let axes = [along, normal.cross(&along)];
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for corner in triangles.iter().flat_map(|&triangle| stage.mesh.corners(triangle)) {
        for (axis, along) in axes.iter().enumerate() {
            let at = (corner - corners[0]).dot(along);
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at);
        }
    }
    let origin = corners[0] + axes[0] * low[0] + axes[1] * low[1];
    (origin, axes, [high[0] - low[0], high[1] - low[1]])
}

/// Small triangles by body, place and direction.
#[derive(Default)]
struct Groups {
    known: HashMap<(usize, [i64; 3], [i64; 3]), u32>,
    members: Vec<(u32, Vec<usize>)>,
}

impl Groups {
    fn add(&mut self, patches: &mut Vec<Patch>, stage: &Stage<'_>, triangle: usize, cell: f64) -> Division {
        let facet = &stage.facets[triangle];
        let corner = stage.mesh.corners(triangle)[0];
        let place = [corner.x, corner.y, corner.z].map(|x| (x / (COARSE * cell)).floor() as i64);
        let facing = [facet.normal.x, facet.normal.y, facet.normal.z].map(|n| n.round() as i64);
        let group = *self.known.entry((facet.body, place, facing)).or_insert_with(|| {
            patches.push(Patch {
                spots: Vec::new(),
                albedo: mean_albedo(stage, facet.body),
            });
            self.members.push(((patches.len() - 1) as u32, Vec::new()));
            (self.members.len() - 1) as u32
        });
        let (patch, members) = &mut self.members[group as usize];
        members.push(triangle);
        Division::Within(*patch)
    }

    /// Chooses places evenly among the members.
    fn spread(&self, patches: &mut [Patch], stage: &Stage<'_>) {
        for (patch, members) in &self.members {
            let count = members.len().min(SPOTS);
            let chosen = (0..count).map(|k| members[(2 * k + 1) * members.len() / (2 * count)]);
            patches[*patch as usize].spots = chosen.map(|triangle| middle(stage, triangle)).collect();
        }
    }
}

fn middle(stage: &Stage<'_>, triangle: usize) -> Origin {
    let normal = stage.facets[triangle].normal;
    let [a, b, c] = stage.mesh.corners(triangle);
    let point = Point3::from((a.coords + b.coords + c.coords) / 3.0) + normal * LIFT;
    Origin { point, normal }
}

/// The point of a triangle that is nearest to one in its plane.
fn nearest(point: &Point3<f64>, corners: &[Point3<f64>; 3]) -> Point3<f64> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let edges = [(a, b), (b, c), (c, a)];
    if edges
        .iter()
        .all(|(from, to)| (*to - *from).cross(&(point - *from)).dot(&normal) >= 0.0)
    {
        return *point;
    }
    let on_edge = edges.map(|(from, to)| {
        let along = to - from;
        let share = (point - from).dot(&along) / along.norm_squared();
        // An edge without length has no share.
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        from + along * share
    });
    let distance = |candidate: &&Point3<f64>| (*candidate - point).norm_squared();
    let best = on_edge.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    *best.unwrap_or(a)
}
