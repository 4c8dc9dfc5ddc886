//! A patch pixel by pixel: what hangs together without a fold, an edge or the object's end between.

use crate::level::Blocks;
use crate::likelihood::single;
use crate::patch::Patch;

/// How far from a patch's inner pixel its first cell may be, cells.
const SEARCH: i64 = 8;

/// Cells of the fine blocks.
#[derive(Debug, Clone)]
pub(crate) struct Region {
    width: usize,
    inside: Vec<bool>,
}

/// An edge runs along a patch's own border, or along what stands over it, which views tell differently: a cell with an
/// edge in it is taken for half of the patch's.
const ON_EDGE: f32 = 0.5;

impl Region {
    /// Grows from a patch's inner pixel over all normals within an angle of the patch's. A cell with an edge in it is the
    /// last one.
    pub(crate) fn grow(fine: &Blocks, patch: &Patch, least_cosine: f64) -> Self {
        let axis = single(&patch.normal);
        let least = least_cosine as f32;
        let is_open = |at: usize| {
            let cell = &fine.cells[at];
            let cosine: f32 = cell.normal.iter().zip(axis).map(|(n, a)| n * a).sum();
            cell.inside > 0.5 && cell.confidence > 0.0 && cosine >= least
        };
        let mut inside = vec![false; fine.cells.len()];
        let mut left: Vec<usize> = first(fine, patch, &is_open).into_iter().collect();
        for &at in &left {
            inside[at] = true;
        }
        while let Some(at) = left.pop() {
            if fine.cells[at].has_edge {
                continue;
            }
            for next in fine.neighbours(at).flatten() {
                if !inside[next] && is_open(next) {
                    inside[next] = true;
                    left.push(next);
                }
            }
        }
        Self {
            width: fine.width,
            inside,
        }
    }

    /// How much of a cell is the patch's: all of it, half or nothing.
    pub(crate) fn share(&self, fine: &Blocks, x: usize, y: usize) -> f32 {
        let at = y * self.width + x;
        if x >= self.width || !self.inside.get(at).copied().unwrap_or(false) {
            0.0
        } else if fine.cells[at].has_edge {
            ON_EDGE
        } else {
            1.0
        }
    }
}

/// The open cell without an edge that is nearest to the inner pixel.
fn first(fine: &Blocks, patch: &Patch, is_open: &impl Fn(usize) -> bool) -> Option<usize> {
    let [x, y] = fine.cell(&patch.inside).map(|at| at.round() as i64);
    let around = (-SEARCH..=SEARCH).flat_map(|dy| (-SEARCH..=SEARCH).map(move |dx| (dx, dy)));
    let cell = |(dx, dy): (i64, i64)| {
        let (x, y) = (x + dx, y + dy);
        let within = (0..fine.width as i64).contains(&x) && (0..fine.height as i64).contains(&y);
        within.then(|| (dx * dx + dy * dy, y as usize * fine.width + x as usize))
    };
    let free = around
        .filter_map(cell)
        .filter(|&(_, at)| is_open(at) && !fine.cells[at].has_edge);
    free.min().map(|(_, at)| at)
}
