//! How likely each cell of a view is a place for a gripper of some orientation.

use nalgebra::Vector3;

use crate::level::{Blocks, Cell};

/// Below this the cell has nothing to do with the patch: farther off than √2 times the angle of one half.
const NOTHING: f32 = 0.25;

/// A von Mises-Fisher density in the angle between normal and orientation, scaled to 1 at angle 0:
/// `exp(κ (n · a - 1))`, with κ such that it is one half at a given angle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Alignment {
    concentration: f32,
    /// Cosines below this give nothing.
    least: f32,
}

impl Alignment {
    pub(crate) fn new(half_likelihood: f64) -> Self {
        let concentration = (std::f64::consts::LN_2 / (1.0 - half_likelihood.cos())) as f32;
        Self {
            concentration,
            least: 1.0 + NOTHING.ln() / concentration,
        }
    }

    /// 0 to 1.
    pub(crate) fn of(self, normal: [f32; 3], axis: &[f32; 3]) -> f32 {
        let cosine = normal[0] * axis[0] + normal[1] * axis[1] + normal[2] * axis[2];
        if cosine < self.least {
            return 0.0;
        }
        (self.concentration * (cosine - 1.0)).exp()
    }

    /// Of a cell, times its confidence; 0 where an edge is.
    pub(crate) fn of_cell(self, cell: &Cell, axis: &[f32; 3]) -> f32 {
        // A line of edges must part the cells on its sides, even where it only clips their corners.
        if cell.has_edge || cell.confidence <= 0.0 {
            return 0.0;
        }
        cell.confidence * self.of(cell.normal, axis)
    }

    /// Of all cells of a view.
    pub(crate) fn image(self, blocks: &Blocks, axis: &Vector3<f64>) -> Vec<f32> {
        let axis = single(axis);
        blocks.cells.iter().map(|cell| self.of_cell(cell, &axis)).collect()
    }
}

pub(crate) fn single(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}
