//! A plate with a random bas-relief.

use geometry::TriangleMesh;
use geometry::nalgebra::Point3;
use serde::Deserialize;

use super::check::{count, sizes};
use crate::SimError;

/// A plate whose top rises and falls smoothly; its rim is level.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Relief {
    /// Along x and y.
    pub size: [f64; 2],
    /// Of the rim.
    pub height: f64,
    /// How far the relief rises above the rim and falls below it.
    pub depth: f64,
    /// Which relief.
    pub seed: u64,
    /// Squares along x and along y.
    pub cells: u32,
}

impl Default for Relief {
    fn default() -> Self {
        Self {
            size: [0.1, 0.1],
            height: 0.01,
            depth: 0.005,
            seed: 1,
            cells: 160,
        }
    }
}

const BUMPS: usize = 14;

/// A hill or a dent; lengths are shares of the plate's sides.
struct Bump {
    centre: [f64; 2],
    radius: f64,
    height: f64,
}

impl Relief {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        sizes("size", &self.size)?;
        sizes("height and depth", &[self.height, self.depth])?;
        count("cells", self.cells, 8..=1000)?;
        if self.depth >= self.height {
            let allowed = format!("less than height, which is {} m", self.height);
            return Err(SimError::value("depth", format!("{} m", self.depth), allowed));
        }
        let mut mesh = TriangleMesh::default();
        self.add_vertices(&mut mesh);
        self.add_faces(&mut mesh);
        Ok(mesh)
    }

    /// The top's grid, row by row, then the bottom's rim in the order in which it is walked, then the bottom's middle.
    fn add_vertices(&self, mesh: &mut TriangleMesh) {
        let (bumps, cells) = (bumps(self.seed), self.cells);
        let share = |index: u32| f64::from(index) / f64::from(cells);
        for (row, column) in (0..=cells).flat_map(|row| (0..=cells).map(move |column| (row, column))) {
            let (u, v) = (share(column), share(row));
            let height = self.height + self.depth * rise(&bumps, u, v);
            let [width, depth] = self.size;
            mesh.vertices
                .push(Point3::new((u - 0.5) * width, (v - 0.5) * depth, height));
        }
        for index in rim(cells) {
            let above = mesh.vertices[index as usize];
            mesh.vertices.push(Point3::new(above.x, above.y, 0.0));
        }
        mesh.vertices.push(Point3::origin());
    }

    fn add_faces(&self, mesh: &mut TriangleMesh) {
        let (cells, width) = (self.cells, self.cells + 1);
        for (row, column) in (0..cells).flat_map(|row| (0..cells).map(move |column| (row, column))) {
            let [a, b] = [row * width + column, row * width + column + 1];
            let [c, d] = [b + width, a + width];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        let rim: Vec<u32> = rim(cells).collect();
        let (count, bottom) = (rim.len() as u32, width * width);
        let middle = bottom + count;
        for index in 0..count {
            let next = (index + 1) % count;
            let (upper, upper_next) = (rim[index as usize], rim[next as usize]);
            let (lower, lower_next) = (bottom + index, bottom + next);
            mesh.triangles.extend([
                [lower, lower_next, upper_next],
                [lower, upper_next, upper],
                [middle, lower_next, lower],
            ]);
        }
    }
}

/// Indices of the grid's outermost points, counter-clockwise seen from above.
fn rim(cells: u32) -> impl Iterator<Item = u32> {
    let width = cells + 1;
    let south = 0..cells;
    let east = (0..cells).map(move |row| row * width + cells);
    let north = (1..=cells).rev().map(move |column| cells * width + column);
    let west = (1..=cells).rev().map(move |row| row * width);
    south.chain(east).chain(north).chain(west)
}

fn bumps(seed: u64) -> Vec<Bump> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut between = |least: f64, most: f64| least + (most - least) * random.f64();
    (0..BUMPS)
        .map(|index| Bump {
            centre: [between(0.15, 0.85), between(0.15, 0.85)],
            radius: between(0.06, 0.16),
            height: if index % 3 == 2 { -1.0 } else { 1.0 },
        })
        .collect()
}

/// -1..=1, and 0 at the rim.
fn rise(bumps: &[Bump], u: f64, v: f64) -> f64 {
    let sum: f64 = bumps
        .iter()
        .map(|bump| {
            let [x, y] = [u - bump.centre[0], v - bump.centre[1]];
            bump.height * (-(x * x + y * y) / (bump.radius * bump.radius)).exp()
        })
        .sum();
    // Zero slope at the rim too.
    let fade = |share: f64| (share * (1.0 - share) * 10.0).clamp(0.0, 1.0);
    sum.tanh() * fade(u) * fade(v)
}
