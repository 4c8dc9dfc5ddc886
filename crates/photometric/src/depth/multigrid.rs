//! Conjugate gradients on a grid of weighted links, preconditioned by multigrid.
//!
//! Coarse grids join 2 x 2 pixels; the weight between two joined groups is the sum of the links between them
//! (aggregation with Galerkin's coarse operator; Notay, "An aggregation-based algebraic multigrid method", 2010). The
//! preconditioner is one V-cycle with damped Jacobi steps, so that threads do not change the result.

use rayon::prelude::*;

/// Damping of Jacobi's method.
const DAMPING: f32 = 0.8;
/// Steps before and after the coarse grid.
const SMOOTHING: usize = 2;
/// Piecewise constant corrections of a coarse grid are too short by about this factor (Braess 1995).
const OVERCORRECTION: f32 = 1.8;
/// Most conjugate gradient steps.
const MOST_STEPS: usize = 60;
/// Grids of fewer pixels are not made coarser.
const COARSEST: usize = 64;
/// Keeps a part without any anchor from drifting: share of the diagonal.
const RIDGE: f32 = 1e-7;

/// A grid of pixels with links to the right and down.
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) right: Vec<f32>,
    pub(super) down: Vec<f32>,
    /// Right hand side.
    pub(super) source: Vec<f32>,
    diagonal: Vec<f32>,
}

impl Level {
    pub(super) fn empty(width: usize, height: usize) -> Self {
        let zeros = || vec![0.0; width * height];
        Self {
            width,
            height,
            right: zeros(),
            down: zeros(),
            source: zeros(),
            diagonal: zeros(),
        }
    }

    /// Fills in what follows from the links.
    pub(super) fn finish(&mut self) {
        for index in 0..self.right.len() {
            let (right, down) = (self.right[index], self.down[index]);
            self.diagonal[index] += (right + down) * (1.0 + RIDGE);
            if right > 0.0 {
                self.diagonal[index + 1] += right * (1.0 + RIDGE);
            }
            if down > 0.0 {
                self.diagonal[index + self.width] += down * (1.0 + RIDGE);
            }
        }
    }

    /// The next coarser grid.
    fn coarser(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut coarse = Self::empty(width, height);
        for y in 0..self.height {
            for x in 0..self.width {
                let (index, group) = (y * self.width + x, y / 2 * width + x / 2);
                if x % 2 == 1 {
                    coarse.right[group] += self.right[index];
                }
                if y % 2 == 1 {
                    coarse.down[group] += self.down[index];
                }
            }
        }
        coarse.finish();
        coarse
    }

    /// `A x`, row by row in parallel.
    fn times(&self, x: &[f32], out: &mut [f32]) {
        self.each(out, |index, links| self.diagonal[index] * x[index] - links.pull(x));
    }

    /// One damped step of Jacobi's method towards `A x = b`; `old` is x before.
    fn relax(&self, b: &[f32], old: &[f32], out: &mut [f32]) {
        self.each(out, |index, links| {
            let diagonal = self.diagonal[index];
            if diagonal <= 0.0 {
                return 0.0;
            }
            let wanted = (b[index] + links.pull(old)) / diagonal;
            old[index] + DAMPING * (wanted - old[index])
        });
    }

    fn each(&self, out: &mut [f32], value: impl Fn(usize, Links) -> f32 + Sync) {
        let rows = out.par_chunks_mut(self.width).with_min_len(32).enumerate();
        rows.for_each(|(y, row)| {
            for (x, slot) in row.iter_mut().enumerate() {
                let index = y * self.width + x;
                *slot = value(index, self.links(x, y, index));
            }
        });
    }

    #[inline]
    fn links(&self, x: usize, y: usize, index: usize) -> Links {
        let weight = |present: bool, weights: &[f32], at: usize| if present { weights[at] } else { 0.0 };
        Links {
            index,
            width: self.width,
            right: self.right[index],
            down: self.down[index],
            left: weight(x > 0, &self.right, index.wrapping_sub(1)),
            up: weight(y > 0, &self.down, index.wrapping_sub(self.width)),
        }
    }
}

/// The four links of a pixel.
#[derive(Clone, Copy)]
struct Links {
    index: usize,
    width: usize,
    right: f32,
    down: f32,
    left: f32,
    up: f32,
}

impl Links {
    /// Weighted sum of the neighbours.
    #[inline]
    fn pull(self, x: &[f32]) -> f32 {
        let at = |weight: f32, index: usize| if weight > 0.0 { weight * x[index] } else { 0.0 };
        at(self.right, self.index + 1)
            + at(self.down, self.index + self.width)
            + at(self.left, self.index.wrapping_sub(1))
            + at(self.up, self.index.wrapping_sub(self.width))
    }
}

/// Solves `A x = source` from the given start; gives the number of steps.
pub(super) fn solve(finest: &Level, x: &mut [f32], tolerance: f32) -> usize {
    let mut coarse: Vec<Level> = Vec::new();
    while coarse.last().map_or(finest.right.len(), |level| level.right.len()) > COARSEST {
        let next = coarse.last().unwrap_or(finest).coarser();
        coarse.push(next);
    }
    let count = x.len();
    let mut residual = vec![0.0; count];
    finest.times(x, &mut residual);
    for (r, b) in residual.iter_mut().zip(&finest.source) {
        *r = b - *r;
    }
    let goal = f64::from(tolerance) * dot(&finest.source, &finest.source).sqrt();
    let (mut direction, mut image) = (vec![0.0; count], vec![0.0; count]);
    let mut before = 0.0;
    for step in 0..MOST_STEPS {
        if dot(&residual, &residual).sqrt() <= goal {
            return step;
        }
        let guess = cycle(finest, &coarse, &residual);
        let product = dot(&residual, &guess);
        let beta = if step == 0 { 0.0 } else { product / before };
        before = product;
        update(&mut direction, &guess, beta as f32);
        finest.times(&direction, &mut image);
        let curvature = dot(&direction, &image);
        if curvature <= 0.0 {
            return step;
        }
        let length = (product / curvature) as f32;
        add(x, &direction, length);
        add(&mut residual, &image, -length);
    }
    MOST_STEPS
}

/// One V-cycle: about `A⁻¹ b`.
fn cycle(level: &Level, coarser: &[Level], b: &[f32]) -> Vec<f32> {
    let mut x = vec![0.0; b.len()];
    let mut spare = vec![0.0; b.len()];
    let smoothing = if coarser.is_empty() { 30 } else { SMOOTHING };
    for _ in 0..smoothing {
        level.relax(b, &x, &mut spare);
        std::mem::swap(&mut x, &mut spare);
    }
    let Some((next, rest)) = coarser.split_first() else {
        return x;
    };
    level.times(&x, &mut spare);
    let mut gathered = vec![0.0; next.right.len()];
    for y in 0..level.height {
        for column in 0..level.width {
            let index = y * level.width + column;
            gathered[y / 2 * next.width + column / 2] += b[index] - spare[index];
        }
    }
    let correction = cycle(next, rest, &gathered);
    let rows = x.par_chunks_mut(level.width).with_min_len(64).enumerate();
    rows.for_each(|(y, row)| {
        for (column, value) in row.iter_mut().enumerate() {
            *value += OVERCORRECTION * correction[y / 2 * next.width + column / 2];
        }
    });
    for _ in 0..SMOOTHING {
        level.relax(b, &x, &mut spare);
        std::mem::swap(&mut x, &mut spare);
    }
    x
}

/// Summed in blocks of fixed size, so that threads do not change the result.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let block = |(a, b): (&[f32], &[f32])| a.iter().zip(b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum::<f64>();
    let sums: Vec<f64> = a.par_chunks(8192).zip(b.par_chunks(8192)).map(block).collect();
    sums.iter().sum()
}

/// `direction = guess + beta · direction`.
fn update(direction: &mut [f32], guess: &[f32], beta: f32) {
    let pairs = direction.par_chunks_mut(8192).zip(guess.par_chunks(8192));
    pairs.for_each(|(direction, guess)| {
        for (d, g) in direction.iter_mut().zip(guess) {
            *d = g + beta * *d;
        }
    });
}

/// `x += factor · y`.
fn add(x: &mut [f32], y: &[f32], factor: f32) {
    let pairs = x.par_chunks_mut(8192).zip(y.par_chunks(8192));
    pairs.for_each(|(x, y)| {
        for (x, y) in x.iter_mut().zip(y) {
            *x += factor * y;
        }
    });
}
