//! The lights of a capture as one linear system.

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::directional_light::DirectionalLight;
use crate::error::PhotometricError;

/// Lights below this ratio of singular values lie nearly in a plane and would amplify noise more than tenfold across
/// it.
pub(crate) const MIN_SINGULAR_RATIO: f64 = 0.05;

/// Rows `intensity * direction`, one per light: brightness = rows × scaled normal.
pub(crate) struct LightMatrix {
    rows: Vec<Vector3<f64>>,
    needed: usize,
}

impl LightMatrix {
    /// Refuses lights that do not determine a normal.
    pub(crate) fn new(lights: &[DirectionalLight], needed: usize) -> Result<Self, PhotometricError> {
        if lights.len() < needed {
            return Err(PhotometricError::TooFewLights {
                got: lights.len(),
                needed,
            });
        }
        for (index, light) in lights.iter().enumerate() {
            if lights[..index]
                .iter()
                .any(|earlier| earlier.channel() == light.channel())
            {
                return Err(PhotometricError::DuplicateLight {
                    channel: light.channel(),
                });
            }
        }
        let ratio = singular_ratio(lights.iter().map(|light| light.direction().into_inner()));
        if ratio < MIN_SINGULAR_RATIO {
            return Err(PhotometricError::CoplanarLights {
                ratio,
                allowed: MIN_SINGULAR_RATIO,
            });
        }
        Ok(Self {
            rows: lights
                .iter()
                .map(|light| light.direction().scale(light.intensity()))
                .collect(),
            needed,
        })
    }

    pub(crate) fn rows(&self) -> &[Vector3<f64>] {
        &self.rows
    }

    /// Columns of the 3 × n matrix that turns all brightnesses into the scaled normal.
    pub(crate) fn pseudo_inverse(&self) -> Vec<Vector3<f32>> {
        let matrix = DMatrix::from_fn(self.rows.len(), 3, |light, axis| self.rows[light][axis]);
        // The rank was checked, so the normal equations can be inverted.
        let inverse = (matrix.transpose() * &matrix)
            .try_inverse()
            .unwrap_or_else(|| DMatrix::zeros(3, 3));
        let pseudo = inverse * matrix.transpose();
        pseudo
            .column_iter()
            .map(|column| Vector3::new(column[0], column[1], column[2]).cast())
            .collect()
    }

    /// The scaled normal from some of the lights, given as (light index, brightness); none when those lights do not
    /// determine it.
    pub(crate) fn solve_some(&self, samples: &[(usize, f32)]) -> Option<Vector3<f32>> {
        let used = samples.iter().map(|&(light, _)| self.rows[light].normalize());
        if samples.len() < self.needed || singular_ratio(used) < MIN_SINGULAR_RATIO {
            return None;
        }
        let mut normal_matrix = Matrix3::zeros();
        let mut right_side = Vector3::zeros();
        for &(light, brightness) in samples {
            let row = self.rows[light];
            normal_matrix += row * row.transpose();
            right_side += row * f64::from(brightness);
        }
        normal_matrix.cholesky().map(|factor| factor.solve(&right_side).cast())
    }
}

/// Smallest over largest singular value of a matrix with these rows, from the eigenvalues of its 3 × 3 Gram matrix.
fn singular_ratio(directions: impl Iterator<Item = Vector3<f64>>) -> f64 {
    let gram: Matrix3<f64> = directions.map(|direction| direction * direction.transpose()).sum();
    let eigenvalues = gram.symmetric_eigenvalues();
    (eigenvalues.min().max(0.0) / eigenvalues.max()).sqrt()
}
