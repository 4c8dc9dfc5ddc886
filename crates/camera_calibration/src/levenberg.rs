//! Levenberg and Marquardt's method on a bundle.

use nalgebra::DMatrix;

use crate::bundle::{Bundle, State};

/// Steps at most; twenty are usual.
const MOST_STEPS: usize = 100;
/// Attempts at a step, each with more damping.
const ATTEMPTS: usize = 10;
/// The fit stands still when its cost falls by a smaller share.
const STILL: f64 = 1e-10;
/// Corners further off than so many standard deviations lose weight.
const ROBUST_SIGMAS: f64 = 3.0;
/// What a corner's standard deviation is at least, pixels.
const LEAST_SIGMA: f64 = 1e-3;
/// Rounds in which the standard deviation is measured anew.
const ROUNDS: usize = 2;

/// Where the search ended.
#[derive(Debug)]
pub(crate) struct Solved {
    pub(crate) state: State,
    /// Covariance of the unknowns: the inverse of the normal matrix times the variance of a residual's component. None
    /// when what was seen does not determine them.
    pub(crate) covariance: Option<DMatrix<f64>>,
    /// Standard deviation of a residual's component, pixels.
    pub(crate) sigma: f64,
}

/// Fits with squares for what is near and lines for what is far; what is near is told from the residuals themselves.
pub(crate) fn solve(bundle: &Bundle, start: State) -> Solved {
    // At first, far off, everything counts fully.
    let mut state = descend(bundle, start, f64::INFINITY);
    for _ in 0..ROUNDS {
        let scale = ROBUST_SIGMAS * sigma(bundle, &state);
        state = descend(bundle, state, scale);
    }
    let sigma = sigma(bundle, &state);
    let normal = bundle.normal(&state, ROBUST_SIGMAS * sigma);
    let covariance = inverse(&normal.matrix).map(|inverse| inverse * (sigma * sigma));
    Solved {
        state,
        covariance,
        sigma,
    }
}

fn descend(bundle: &Bundle, start: State, scale: f64) -> State {
    let mut state = start;
    let mut damping = 1e-3;
    let mut cost = bundle.cost(&state, scale);
    for _ in 0..MOST_STEPS {
        let Some((next, lower)) = step(bundle, &state, cost, scale, &mut damping) else {
            break;
        };
        let is_still = cost - lower <= STILL * cost;
        (state, cost) = (next, lower);
        if is_still {
            break;
        }
    }
    state
}

/// A step that lowers the cost; none when there is no such step.
fn step(bundle: &Bundle, state: &State, cost: f64, scale: f64, damping: &mut f64) -> Option<(State, f64)> {
    let normal = bundle.normal(state, scale);
    for _ in 0..ATTEMPTS {
        let mut damped = normal.matrix.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] *= 1.0 + *damping;
        }
        if let Some(factor) = damped.cholesky() {
            let trial = state.moved(&factor.solve(&normal.right));
            let lower = bundle.cost(&trial, scale);
            if lower < cost {
                *damping = (*damping / 10.0).max(1e-12);
                return Some((trial, lower));
            }
        }
        *damping *= 10.0;
    }
    None
}

/// Standard deviation of a residual's component, from the median length, pixels; unknowns take up a part of what there is.
fn sigma(bundle: &Bundle, state: &State) -> f64 {
    let residuals = bundle.sightings.iter().filter_map(|sighting| state.residuals(sighting));
    let mut lengths: Vec<f64> = residuals.flatten().map(|residual| residual.norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let median = lengths.get(lengths.len() / 2).copied().unwrap_or(LEAST_SIGMA);
    let given = 2.0 * lengths.len() as f64;
    let free = (given - bundle.unknowns(state) as f64).max(1.0);
    // The median length of two normal components is 1.177 of their standard deviation.
    (median / 1.177 * (given / free).sqrt()).max(LEAST_SIGMA)
}

/// Unknowns of very different sizes are scaled before, so that the test for what is undetermined is fair.
fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scales: Vec<f64> = (0..matrix.nrows()).map(|i| 1.0 / matrix[(i, i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] * scales[i] * scales[j]
    });
    let inverse = scaled.cholesky()?.inverse();
    let found = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        inverse[(i, j)] * scales[i] * scales[j]
    });
    found.iter().all(|value| value.is_finite()).then_some(found)
}
