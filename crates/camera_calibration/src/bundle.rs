//! All that is looked for at once: cameras and poses that bring the target's corners to where they were seen.
//!
//! A picture's `camera_from_target` is a chain of poses, some known, some looked for. One camera: the pose itself. Two:
//! `c2_from_c1 · c1_from_target`. Eye in hand: `camera_from_flange · flange_from_base · base_from_target`, with the middle
//! one known. So one solver serves all calibrations. Where the arm is not quite where it says, a chain has a small pose
//! more, held near the identity by a [`Prior`].
//!
//! | symbol | meaning |
//! |---|---|
//! | `r` | a corner's residual: where it falls less where it was seen, pixels |
//! | `ω, v` | a pose's step: `R ← exp(ω) R`, `t ← t + v` |

use geometry::RigidTransform;
use nalgebra::{DMatrix, DVector, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

use crate::homography::Match;
use crate::lens::{FixedLens, LENS, LensValues};

/// Numbers of a pose's step.
pub(crate) const POSE: usize = 6;

/// A factor of a chain.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Link {
    Known(RigidTransform),
    /// Of [`State::poses`].
    Sought(usize),
}

/// A picture of the target.
#[derive(Debug, Clone)]
pub(crate) struct Sighting {
    /// Of [`State::lenses`].
    pub(crate) camera: usize,
    /// From the camera to the target.
    pub(crate) chain: Vec<Link>,
    pub(crate) matches: Vec<Match>,
}

/// A pose that is near the identity.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prior {
    /// Of [`State::poses`].
    pub(crate) pose: usize,
    /// What a standard deviation of its rotation (1 / radians) and its translation (1 / metres) counts, pixels.
    pub(crate) weights: [f64; 2],
    /// From here on it loses weight, pixels.
    pub(crate) scale: f64,
}

/// What is looked for, as far as it is known.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) lenses: Vec<LensValues>,
    pub(crate) poses: Vec<RigidTransform>,
}

/// Everything that was seen.
#[derive(Debug)]
pub(crate) struct Bundle {
    pub(crate) sightings: Vec<Sighting>,
    /// For each camera.
    pub(crate) fixed: Vec<FixedLens>,
    pub(crate) priors: Vec<Prior>,
}

/// Normal equations of a state.
pub(crate) struct Normal {
    pub(crate) matrix: DMatrix<f64>,
    /// Downhill.
    pub(crate) right: DVector<f64>,
    /// The robust sum of squares.
    pub(crate) cost: f64,
}

impl State {
    /// Columns of the unknowns: cameras, then poses.
    pub(crate) fn unknowns(&self) -> usize {
        LENS * self.lenses.len() + POSE * self.poses.len()
    }

    /// First column of a pose.
    pub(crate) fn pose_column(&self, pose: usize) -> usize {
        LENS * self.lenses.len() + POSE * pose
    }

    pub(crate) fn moved(&self, step: &DVector<f64>) -> Self {
        let mut moved = self.clone();
        for (index, lens) in moved.lenses.iter_mut().enumerate() {
            for (value, change) in lens.0.iter_mut().zip(step.rows(LENS * index, LENS).iter()) {
                *value += change;
            }
        }
        for (index, pose) in moved.poses.iter_mut().enumerate() {
            let own = step.fixed_rows::<POSE>(self.pose_column(index));
            let turn = UnitQuaternion::from_scaled_axis(own.fixed_rows::<3>(0).into_owned());
            let translation = pose.translation() + own.fixed_rows::<3>(3);
            let rotation = UnitQuaternion::new_normalize((turn * pose.rotation()).into_inner());
            *pose = RigidTransform::from_parts(translation, rotation);
        }
        moved
    }

    pub(crate) fn transform(&self, link: &Link) -> RigidTransform {
        match *link {
            Link::Known(pose) => pose,
            Link::Sought(pose) => self.poses[pose],
        }
    }

    pub(crate) fn camera_from_target(&self, sighting: &Sighting) -> RigidTransform {
        let links = sighting.chain.iter().map(|link| self.transform(link));
        links.fold(RigidTransform::identity(), |product, pose| product * pose)
    }

    /// Where every corner falls less where it was seen, pixels; none when one is behind the camera.
    pub(crate) fn residuals(&self, sighting: &Sighting) -> Option<Vec<Vector2<f64>>> {
        let pose = self.camera_from_target(sighting);
        let lens = &self.lenses[sighting.camera];
        let residual = |(point, pixel): &Match| {
            let projected = lens.project(&pose.transform_point(point).coords)?;
            Some(projected.pixel - pixel.coords)
        };
        sighting.matches.iter().map(residual).collect()
    }
}

/// Huber's norm: squares up to `scale`, then lines.
fn huber(square: f64, scale: f64) -> (f64, f64) {
    let length = square.sqrt();
    if length <= scale {
        (square, 1.0)
    } else {
        (scale * (2.0 * length - scale), scale / length)
    }
}

impl Bundle {
    /// Numbers that are fitted.
    pub(crate) fn unknowns(&self, state: &State) -> usize {
        let fixed = self.fixed.iter().flat_map(FixedLens::mask).filter(|&fixed| fixed);
        state.unknowns() - fixed.count()
    }

    /// The robust sum of squares; infinite when a corner is behind its camera.
    pub(crate) fn cost(&self, state: &State, scale: f64) -> f64 {
        let of_sighting = |sighting: &Sighting| {
            state.residuals(sighting).map_or(f64::INFINITY, |residuals| {
                residuals.iter().map(|r| huber(r.norm_squared(), scale).0).sum()
            })
        };
        let of_prior = |prior: &Prior| huber(prior.misfit(state).norm_squared(), prior.limit(scale)).0;
        let seen: f64 = self.sightings.iter().map(of_sighting).sum();
        seen + self.priors.iter().map(of_prior).sum::<f64>()
    }

    pub(crate) fn normal(&self, state: &State, scale: f64) -> Normal {
        let size = state.unknowns();
        let mut normal = Normal {
            matrix: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
            cost: 0.0,
        };
        for sighting in &self.sightings {
            self.add(state, sighting, scale, &mut normal);
        }
        for prior in &self.priors {
            prior.add(state, scale, &mut normal);
        }
        // What is fixed, or never seen, stays: its rows are zero but for this.
        for i in 0..size {
            if normal.matrix[(i, i)] == 0.0 {
                normal.matrix[(i, i)] = 1.0;
            }
        }
        normal
    }

    /// Adds a picture's part; corners behind the camera have none (the cost tells of them).
    fn add(&self, state: &State, sighting: &Sighting, scale: f64, normal: &mut Normal) {
        let lens = &state.lenses[sighting.camera];
        let mask = self.fixed[sighting.camera].mask();
        let chain: Vec<RigidTransform> = sighting.chain.iter().map(|link| state.transform(link)).collect();
        let mut columns: Vec<usize> = (0..LENS).map(|i| LENS * sighting.camera + i).collect();
        for link in &sighting.chain {
            if let Link::Sought(pose) = link {
                columns.extend((0..POSE).map(|i| state.pose_column(*pose) + i));
            }
        }
        for (point, pixel) in &sighting.matches {
            let turned = turned_points(&chain, &point.coords);
            let Some(projected) = lens.project(&(turned[0] + chain[0].translation())) else {
                continue;
            };
            let residual = projected.pixel - pixel.coords;
            let (cost, weight) = huber(residual.norm_squared(), scale);
            normal.cost += cost;
            let mut rows = DMatrix::zeros(2, columns.len());
            for (i, is_fixed) in mask.iter().enumerate() {
                if !is_fixed {
                    rows.set_column(i, &projected.by_lens.column(i));
                }
            }
            let mut at = LENS;
            let mut by_link = projected.by_point;
            for ((link, pose), turned) in sighting.chain.iter().zip(&chain).zip(&turned) {
                if let Link::Sought(_) = link {
                    let by_turn = -by_link * turned.cross_matrix();
                    rows.fixed_view_mut::<2, 3>(0, at).copy_from(&by_turn);
                    rows.fixed_view_mut::<2, 3>(0, at + 3).copy_from(&by_link);
                    at += POSE;
                }
                by_link *= pose.rotation_matrix();
            }
            scatter(&rows, &columns, &residual, weight, normal);
        }
    }
}

impl Prior {
    /// Rotation and translation, pixels.
    fn misfit(&self, state: &State) -> SVector<f64, POSE> {
        let pose = &state.poses[self.pose];
        let mut misfit = SVector::<f64, POSE>::zeros();
        let turn = pose.rotation().scaled_axis() * self.weights[0];
        misfit.fixed_rows_mut::<3>(0).copy_from(&turn);
        misfit
            .fixed_rows_mut::<3>(3)
            .copy_from(&(pose.translation() * self.weights[1]));
        misfit
    }

    /// While nothing loses weight, priors do not either.
    fn limit(&self, scale: f64) -> f64 {
        if scale.is_finite() { self.scale } else { scale }
    }

    /// Near the identity a rotation vector changes as its step does.
    fn add(&self, state: &State, scale: f64, normal: &mut Normal) {
        let misfit = self.misfit(state);
        let (cost, weight) = huber(misfit.norm_squared(), self.limit(scale));
        normal.cost += cost;
        for i in 0..POSE {
            let column = state.pose_column(self.pose) + i;
            let slope = self.weights[i / 3];
            normal.matrix[(column, column)] += weight * slope * slope;
            normal.right[column] -= weight * slope * misfit[i];
        }
    }
}

/// The point as each link turns it, before the link's translation.
fn turned_points(chain: &[RigidTransform], point: &Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut turned = vec![Vector3::zeros(); chain.len()];
    let mut point = *point;
    for (pose, turned) in chain.iter().zip(&mut turned).rev() {
        *turned = pose.rotation() * point;
        point = *turned + pose.translation();
    }
    turned
}

fn scatter(rows: &DMatrix<f64>, columns: &[usize], residual: &Vector2<f64>, weight: f64, normal: &mut Normal) {
    for (i, &row) in columns.iter().enumerate() {
        let own: SMatrix<f64, 2, 1> = rows.fixed_view::<2, 1>(0, i) * weight;
        normal.right[row] -= own.dot(residual);
        for (j, &column) in columns.iter().enumerate() {
            normal.matrix[(row, column)] += own.dot(&rows.fixed_view::<2, 1>(0, j));
        }
    }
}

/// Standard deviations of a pose's rotation (radians) and translation (metres).
pub(crate) fn pose_deviations(covariance: &DMatrix<f64>, column: usize) -> [f64; 2] {
    let trace = |from: usize| -> f64 { (from..from + 3).map(|i| covariance[(i, i)]).sum() };
    [trace(column), trace(column + 3)].map(|sum| sum.max(0.0).sqrt())
}

/// The same of the inverse of a pose with this translation: `-Rᵀ t` moves by `-Rᵀ (v + t x ω)`.
pub(crate) fn inverse_deviations(covariance: &DMatrix<f64>, column: usize, translation: &Vector3<f64>) -> [f64; 2] {
    let own = covariance.fixed_view::<POSE, POSE>(column, column);
    let mut by_step = SMatrix::<f64, 3, POSE>::zeros();
    by_step
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&translation.cross_matrix());
    by_step.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    let moved = (by_step * own * by_step.transpose()).trace();
    [pose_deviations(covariance, column)[0], moved.max(0.0).sqrt()]
}
